//! Content hashes of files and folders.

use crate::SuiteError;
use std::collections::BTreeMap;
use std::path::Path;

/// Length of a printed hash: 128 bits in hexadecimal.
const HEX: usize = 32;

/// Hash of bytes, 32 hexadecimal digits of BLAKE3.
pub fn of_bytes(bytes: &[u8]) -> String {
    blake3::hash(bytes).to_hex()[..HEX].to_owned()
}

/// Hash of a file's content.
///
/// # Errors
/// If the file cannot be read.
pub fn of_file(path: &Path) -> Result<String, SuiteError> {
    let file = std::fs::File::open(path).map_err(|e| SuiteError::file(path, e))?;
    let mut hasher = blake3::Hasher::new();
    hasher.update_reader(file).map_err(|e| SuiteError::file(path, e))?;
    Ok(hasher.finalize().to_hex()[..HEX].to_owned())
}

/// Hash of every file below a folder, by its path from the folder with `/` between parts.
///
/// # Errors
/// If something in the folder cannot be read.
pub fn files(dir: &Path) -> Result<BTreeMap<String, String>, SuiteError> {
    let mut found = BTreeMap::new();
    walk(dir, "", &mut found)?;
    Ok(found)
}

fn walk(dir: &Path, prefix: &str, found: &mut BTreeMap<String, String>) -> Result<(), SuiteError> {
    for entry in std::fs::read_dir(dir).map_err(|e| SuiteError::file(dir, e))? {
        let entry = entry.map_err(|e| SuiteError::file(dir, e))?;
        let name = format!("{prefix}{}", entry.file_name().to_string_lossy());
        if entry.path().is_dir() {
            walk(&entry.path(), &format!("{name}/"), found)?;
        } else {
            found.insert(name, of_file(&entry.path())?);
        }
    }
    Ok(())
}

/// One hash for a folder's names and contents.
///
/// # Errors
/// If something in the folder cannot be read.
pub fn of_folder(dir: &Path) -> Result<String, SuiteError> {
    Ok(of_map(&files(dir)?))
}

/// One hash for names and values, unambiguous about where each ends.
pub fn of_map(map: &BTreeMap<String, String>) -> String {
    let mut hasher = blake3::Hasher::new();
    for (name, value) in map {
        for part in [name, value] {
            hasher.update(&(part.len() as u64).to_le_bytes());
            hasher.update(part.as_bytes());
        }
    }
    hasher.finalize().to_hex()[..HEX].to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_hash_sees_names_and_contents() {
        let dir = tempfile::tempdir().unwrap();
        std::fs::create_dir(dir.path().join("sub")).unwrap();
        std::fs::write(dir.path().join("sub/a"), "one").unwrap();
        let first = of_folder(dir.path()).unwrap();
        assert_eq!(first, of_folder(dir.path()).unwrap());
        std::fs::write(dir.path().join("sub/a"), "two").unwrap();
        let changed = of_folder(dir.path()).unwrap();
        assert_ne!(first, changed);
        std::fs::rename(dir.path().join("sub/a"), dir.path().join("sub/b")).unwrap();
        assert_ne!(changed, of_folder(dir.path()).unwrap());
    }

    #[test]
    fn a_map_hash_is_unambiguous() {
        let map = |pairs: &[(&str, &str)]| {
            of_map(&pairs.iter().map(|(a, b)| ((*a).to_owned(), (*b).to_owned())).collect())
        };
        assert_ne!(map(&[("a", "bc")]), map(&[("ab", "c")]));
        assert_ne!(map(&[("a", ""), ("b", "")]), map(&[("a", "b")]));
    }
}

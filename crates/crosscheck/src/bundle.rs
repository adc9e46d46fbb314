//! Named arrays and metadata that pass between the two sides, as safetensors files.

use crate::CrossError;
use glam::Vec3;
use safetensors::tensor::{Dtype, SafeTensors, TensorView, serialize};
use serde_json::Value;
use std::borrow::Cow;
use std::collections::{BTreeMap, HashMap};
use std::path::Path;

/// Largest file that is read, bytes.
const MAX_BYTES: u64 = 1 << 32;

/// Little-endian values and their shape, the last axis running fastest.
#[derive(Clone, Debug, PartialEq)]
pub struct Array {
    shape: Vec<usize>,
    dtype: Dtype,
    bytes: Vec<u8>,
}

/// A type of element.
pub trait Element: Copy {
    /// Its name in the file.
    const DTYPE: Dtype;
    /// Appends the little-endian bytes.
    fn push(self, out: &mut Vec<u8>);
    /// From little-endian bytes, as many as the type has.
    fn take(bytes: &[u8]) -> Self;
}

macro_rules! element {
    ($($t:ty = $d:ident),*) => {
        $(impl Element for $t {
            const DTYPE: Dtype = Dtype::$d;
            fn push(self, out: &mut Vec<u8>) {
                out.extend_from_slice(&self.to_le_bytes());
            }
            fn take(bytes: &[u8]) -> $t {
                <$t>::from_le_bytes(bytes.try_into().expect("as many bytes as the type has"))
            }
        })*
    };
}
element!(f32 = F32, f64 = F64, u32 = U32, i32 = I32, u8 = U8);

impl Array {
    /// Values in the shape given.
    pub fn new<T: Element>(shape: &[usize], values: impl IntoIterator<Item = T>) -> Array {
        let mut bytes = Vec::new();
        values.into_iter().for_each(|v| v.push(&mut bytes));
        let array = Array { shape: shape.to_vec(), dtype: T::DTYPE, bytes };
        assert_eq!(array.bytes.len(), array.len() * array.dtype.bitsize() / 8, "values fill {shape:?}");
        array
    }

    fn len(&self) -> usize {
        self.shape.iter().product()
    }
}

impl safetensors::View for &Array {
    fn dtype(&self) -> Dtype {
        self.dtype
    }
    fn shape(&self) -> &[usize] {
        &self.shape
    }
    fn data(&self) -> Cow<'_, [u8]> {
        Cow::Borrowed(&self.bytes)
    }
    fn data_len(&self) -> usize {
        self.bytes.len()
    }
}

/// Arrays by name, and metadata.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Bundle {
    /// What it belongs to, for messages.
    pub job: String,
    arrays: BTreeMap<String, Array>,
    meta: BTreeMap<String, Value>,
}

impl Bundle {
    /// An empty bundle of the job.
    pub fn new(job: &str) -> Bundle {
        Bundle { job: job.to_owned(), ..Bundle::default() }
    }

    /// Adds an array.
    #[must_use]
    pub fn with<T: Element>(
        mut self,
        name: &str,
        shape: &[usize],
        values: impl IntoIterator<Item = T>,
    ) -> Bundle {
        self.arrays.insert(name.to_owned(), Array::new(shape, values));
        self
    }

    /// Adds three-vectors, indexed `[i][xyz]`.
    #[must_use]
    pub fn with_vec3(self, name: &str, values: &[Vec3]) -> Bundle {
        self.with(name, &[values.len(), 3], values.iter().flat_map(|v| v.to_array()))
    }

    /// Adds metadata.
    #[must_use]
    pub fn with_meta(mut self, key: &str, value: impl Into<Value>) -> Bundle {
        self.meta.insert(key.to_owned(), value.into());
        self
    }

    fn fault(&self, name: &str, fault: String) -> CrossError {
        CrossError::Array { job: self.job.clone(), name: name.to_owned(), fault }
    }

    /// An array's values.
    ///
    /// # Errors
    /// If it is not there, or not in this shape and type; a 0 in `shape` stands for any length.
    pub fn get<T: Element>(&self, name: &str, shape: &[usize]) -> Result<Vec<T>, CrossError> {
        let array = self.arrays.get(name).ok_or_else(|| self.fault(name, "is not there".into()))?;
        let fits = array.shape.len() == shape.len()
            && array.shape.iter().zip(shape).all(|(&have, &want)| want == 0 || have == want);
        if !fits || array.dtype != T::DTYPE {
            let (have, want) = (array.dtype, T::DTYPE);
            return Err(
                self.fault(name, format!("is {have:?} {:?} where {want:?} {shape:?} is needed", array.shape))
            );
        }
        Ok(array.bytes.chunks_exact(size_of::<T>()).map(T::take).collect())
    }

    /// Three-vectors, indexed `[i][xyz]`; `count` 0 stands for any number.
    ///
    /// # Errors
    /// As [`Bundle::get`].
    pub fn vec3(&self, name: &str, count: usize) -> Result<Vec<Vec3>, CrossError> {
        Ok(self.get::<f32>(name, &[count, 3])?.chunks_exact(3).map(Vec3::from_slice).collect())
    }

    /// A metadata value read as `T`.
    ///
    /// # Errors
    /// If it is not there or of another form.
    pub fn meta<T: serde::de::DeserializeOwned>(&self, key: &str) -> Result<T, CrossError> {
        let value = self.meta.get(key).ok_or_else(|| self.fault(key, "metadata is not there".into()))?;
        serde_json::from_value(value.clone()).map_err(|e| self.fault(key, e.to_string()))
    }

    /// A hash of everything in it, the same on every machine.
    pub fn hash(&self) -> String {
        let mut hasher = blake3::Hasher::new();
        let mut add = |bytes: &[u8]| {
            hasher.update(&(bytes.len() as u64).to_le_bytes());
            hasher.update(bytes);
        };
        for (name, array) in &self.arrays {
            add(name.as_bytes());
            add(format!("{:?} {:?}", array.dtype, array.shape).as_bytes());
            add(&array.bytes);
        }
        for (key, value) in &self.meta {
            add(key.as_bytes());
            add(value.to_string().as_bytes());
        }
        hasher.finalize().to_hex()[..16].to_owned()
    }

    /// Writes the file.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), CrossError> {
        let meta: HashMap<String, String> =
            self.meta.iter().map(|(k, v)| (k.clone(), v.to_string())).collect();
        let bytes = serialize(self.arrays.iter(), Some(meta)).map_err(|e| CrossError::file(path, e))?;
        strandbench_io::atomic_write(path, |f| f.write_all(&bytes)).map_err(|e| CrossError::file(path, e))
    }

    /// Reads a file of the job.
    ///
    /// # Errors
    /// If it cannot be read, is larger than 4 GiB, or is no bundle.
    pub fn read(path: &Path, job: &str) -> Result<Bundle, CrossError> {
        let fault = |e: &dyn std::fmt::Display| CrossError::file(path, e);
        let length = std::fs::metadata(path).map_err(|e| fault(&e))?.len();
        if length > MAX_BYTES {
            return Err(fault(&format!("{length} bytes are more than the {MAX_BYTES} that are read")));
        }
        Bundle::parse(&std::fs::read(path).map_err(|e| fault(&e))?, job).map_err(|e| fault(&e))
    }

    /// Reads a bundle from the bytes of a file.
    ///
    /// # Errors
    /// What is wrong with the bytes.
    pub fn parse(bytes: &[u8], job: &str) -> Result<Bundle, String> {
        let (_, header) = SafeTensors::read_metadata(bytes).map_err(|e| e.to_string())?;
        let mut bundle = Bundle::new(job);
        for (key, text) in header.metadata().iter().flatten() {
            let value = serde_json::from_str(text).map_err(|e| format!("metadata {key}: {e}"))?;
            bundle.meta.insert(key.clone(), value);
        }
        let tensors = SafeTensors::deserialize(bytes).map_err(|e| e.to_string())?;
        for (name, view) in tensors.iter() {
            let view: TensorView = view;
            let array =
                Array { shape: view.shape().to_vec(), dtype: view.dtype(), bytes: view.data().to_vec() };
            bundle.arrays.insert(name.to_owned(), array);
        }
        Ok(bundle)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bundle() -> Bundle {
        Bundle::new("test")
            .with("a", &[2, 3], [1.0f32, -2.0, f32::INFINITY, 0.5, f32::MIN_POSITIVE, 6.0])
            .with("b", &[4], [7u8, 0, 255, 1])
            .with_meta("optics", serde_json::json!({"index": 1.55, "names": ["x"]}))
    }

    #[test]
    fn what_is_written_reads_back_and_every_change_changes_the_hash() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.safetensors");
        let b = bundle();
        b.write(&path).unwrap();
        let back = Bundle::read(&path, "test").unwrap();
        assert_eq!(back, b);
        assert_eq!(back.hash(), b.hash());
        assert_eq!(back.vec3("a", 2).unwrap()[1], Vec3::new(0.5, f32::MIN_POSITIVE, 6.0));
        let others = [
            b.clone().with("b", &[4], [7u8, 0, 255, 2]),
            b.clone().with("b", &[2, 2], [7u8, 0, 255, 1]),
            b.clone().with("b", &[4], [7i32, 0, 255, 1]),
            b.clone().with_meta("optics", 3),
            b.clone().with("c", &[0], [0u8; 0]),
        ];
        assert!(others.iter().all(|o| o.hash() != b.hash()));
    }

    #[test]
    fn arrays_that_do_not_fit_are_named_and_broken_files_refused() {
        let b = bundle();
        for (e, word) in [
            (b.get::<f32>("c", &[1]).unwrap_err(), "array c of test: is not there"),
            (b.get::<f32>("a", &[3, 2]).unwrap_err(), "is F32 [2, 3] where F32 [3, 2]"),
            (b.get::<f64>("a", &[0, 3]).unwrap_err(), "F64"),
        ] {
            assert!(e.to_string().contains(word), "{e}");
        }
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.safetensors");
        b.write(&path).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        for cut in [0, 4, 8, 40, bytes.len() - 1] {
            assert!(Bundle::parse(&bytes[..cut], "t").is_err(), "{cut} bytes");
        }
        let mut huge = bytes.clone();
        huge[..8].copy_from_slice(&u64::MAX.to_le_bytes());
        assert!(Bundle::parse(&huge, "t").is_err());
        assert!(Bundle::read(&folder.path().join("none"), "t").unwrap_err().to_string().contains("none"));
    }
}

"""Makes the committed answers of levels 0 to 3: `python renderer/mitsuba/make_fixtures.py` from the root of the
repository, with a Python that has requirements.txt. Review what changes like code: a fixture that moves is a
renderer that moved, a scene that was changed on purpose, or another version of a witness."""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import exchange

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
FIXTURES = ROOT / "crates" / "crosscheck" / "fixtures"


def main():
    FIXTURES.mkdir(exist_ok=True)
    wanted = set()
    with tempfile.TemporaryDirectory() as folder:
        export = ["run", "--release", "-p", "strandbench-crosscheck", "--example", "export", "--"]
        subprocess.run([os.environ.get("CARGO", "cargo"), *export, folder], cwd=ROOT, check=True)
        for source in sorted(Path(folder).glob("*.safetensors")):
            _, meta = exchange.read(source)
            target = FIXTURES / source.name
            answer = Path(folder) / "answer"
            # One process a job, as in the live check.
            subprocess.run(
                [sys.executable, HERE / "witness.py", meta["job"], "scalar_rgb", source, answer], check=True
            )
            arrays, provenance = exchange.read(answer)
            del provenance["cpu_s"]  # Would differ each time.
            exchange.write(target, arrays, provenance | {"input_hash": meta["input_hash"]})
            wanted.add(target)
            print(f"{target.relative_to(ROOT)}: {target.stat().st_size} bytes, input {meta['input_hash']}")
    for stale in set(FIXTURES.glob("*.safetensors")) - wanted:
        stale.unlink()
        print(f"{stale.relative_to(ROOT)}: removed, no case of this name")


if __name__ == "__main__":
    main()

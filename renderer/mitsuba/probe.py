"""Says, as one line of JSON, which witnesses this Python has. Started as a process of its own, since an LLVM
that does not fit this processor ends the process."""

import json
import sys
from importlib.metadata import PackageNotFoundError, version


def main(variant):
    found = {"python": sys.version.split()[0]}
    for package in ("mitsuba", "drjit", "embreex", "numpy", "safetensors"):
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = None
    if variant:
        import drjit as dr
        import mitsuba as mi

        mi.set_variant(variant)
        if variant.startswith("llvm"):
            # Compiles and runs something: an unfit LLVM fails here and not in a job.
            found["sum"] = float(dr.sum(dr.sqrt(dr.arange(mi.Float, 16)))[0])
        found["variant"] = mi.variant()
    print(json.dumps(found))


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "")

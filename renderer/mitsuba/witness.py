"""Runs one reference job: `python witness.py JOB VARIANT INPUT OUTPUT`. One process a job, so that what one job
leaves behind cannot touch the next; the exit code says whether it ended well."""

import sys
import time
from importlib.metadata import version

import mitsuba as mi

import exchange


def main(job, variant, source, target):
    mi.set_variant(variant)
    mi.set_log_level(mi.LogLevel.Warn)
    # After the variant is chosen: these look into it.
    import jobs
    import marschner_bsdf

    marschner_bsdf.register()
    arrays, meta = exchange.read(source)
    start = time.process_time()
    out = jobs.JOBS[job](arrays, meta)
    provenance = {
        "job": job,
        "variant": variant,
        "versions": {name: version(name) for name in ("mitsuba", "drjit", "embreex", "numpy")},
        "cpu_s": time.process_time() - start,
    }
    exchange.write(target, out, provenance)


if __name__ == "__main__":
    if len(sys.argv) != 5:
        sys.exit(__doc__)
    main(*sys.argv[1:])

"""Bundles of named arrays with text metadata (safetensors files), as the Rust side writes and reads them."""

import json

import numpy as np
from safetensors import safe_open
from safetensors.numpy import save_file


def read(path):
    """The arrays by name, and the metadata with each value parsed as JSON."""
    with safe_open(path, framework="numpy") as bundle:
        arrays = {name: bundle.get_tensor(name) for name in bundle.keys()}
        meta = {key: json.loads(value) for key, value in (bundle.metadata() or {}).items()}
    return arrays, meta


def write(path, arrays, meta):
    """Writes arrays and metadata; each metadata value becomes JSON text."""
    dense = {name: np.ascontiguousarray(array) for name, array in arrays.items()}
    save_file(dense, path, metadata={key: json.dumps(value) for key, value in meta.items()})

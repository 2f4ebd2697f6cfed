"""What the files of a run follow from, as one digest: a folder with the same key need not be made again."""

import hashlib
import json
import os
from dataclasses import asdict, replace

from cad.design.design_file import design_as_mapping
from cad.design.parameters import Design
from cad.files.file_date import NAME
from pipeline.options import RunOptions
from pipeline.storage.versions import code_digest, declared_packages, installed_version, pages_digest


def run_key(design: Design, options: RunOptions) -> str:
    """Return the digest of a design, the options of its run, the date of its files, the program, pages and packages."""
    inputs = {
        "design": design_as_mapping(design),
        "options": asdict(replace(options, out=None, force=False)),
        "date": os.environ.get(NAME),
        "packages": {name: installed_version(name) for name in ("twintip", *declared_packages())},
        "code": code_digest(),
        "pages": pages_digest(),
    }
    return hashlib.sha256(json.dumps(inputs, sort_keys=True).encode()).hexdigest()

"""Files that a study writes for a person: refused before anything is solved where they could not be written."""

from collections.abc import Sequence
from pathlib import Path

from cad.quantity import validation_error
from pipeline.storage.files import refuse_taken


def refuse_output(path: Path, endings: Sequence[str], folder: Path, flag: str, *, force: bool) -> None:
    """Raise InputError where a file has another ending or no folder, or where a file that is not ours is in the way.

    The folder of the study is made later.
    """
    if path.suffix not in endings:
        bound = f"a file name that ends in {' or '.join(endings)}"
        raise validation_error(flag, str(path), "", bound, "change its ending")
    if not path.parent.is_dir() and path.parent.resolve() != folder.resolve():
        raise validation_error(flag, str(path), "", "a file in a folder that is there", "make that folder first")
    refuse_taken([path], flag, force=force, renew=True)

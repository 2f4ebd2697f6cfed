"""The words that name quantities and units in tables, in each language of words.toml."""

import tomllib
import unicodedata
from pathlib import Path

WORDS = tomllib.loads(Path(__file__).with_name("words.toml").read_text(encoding="utf-8"))
"""The content of words.toml."""
FOREIGN_WORDS = {
    unicodedata.normalize("NFKC", word).casefold()
    for words in (*WORDS["words"].values(), *WORDS["units"].values())
    for word in words
    if not word.isascii()
}
"""The words that contain other letters than ASCII, in lower case; they show in which encoding a text is written."""

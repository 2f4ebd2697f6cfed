"""The pictures of the part and of how it goes together, as the page takes them: it needs no solid for them."""

from dataclasses import dataclass

from pipeline.report.page.drawing.picture import Picture


@dataclass(frozen=True, kw_only=True)
class SolidPictures:
    """The printed part, and all that is put together drawn apart; None where no part is made."""

    part: Picture | None = None
    assembly: Picture | None = None

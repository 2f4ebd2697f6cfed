"""A one-page PDF file of a drawing at true size, with lines, curves and filled areas.

The format is described in Adobe, PDF Reference 1.7, 2006: page operators in appendix A, and file structure in
section 3.4.
"""

import zlib
from collections.abc import Iterable

from ezdxf.addons.drawing.backend import BkPath2d, BkPoints2d
from ezdxf.addons.drawing.properties import BackendProperties
from ezdxf.addons.drawing.recorder import Recorder
from ezdxf.math import Vec2
from ezdxf.path.commands import Curve3To, Curve4To, MoveTo

POINTS = 72.0 / 25.4  # PDF units (points, 1/72 inch) per millimetre


class PdfPage(Recorder):
    """A black-and-white page. It collects the PDF operators for everything that ezdxf draws on it."""

    def __init__(self, corner: tuple[float, float], scale: float) -> None:
        """Create an empty page.

        `corner` [mm] is the point of the drawing at the lower left corner of the page. `scale` [1] is the ratio of a
        length on paper to the length in the drawing.
        """
        super().__init__()
        self._corner = Vec2(corner)
        self._unit = scale * POINTS
        self._operators = ["1 J 1 j"]  # round line caps and joins

    def file_bytes(self, width: float, height: float) -> bytes:
        """Return the bytes of a PDF file with this page, given the width and height of the paper [mm].

        A PDF file consists of a header, numbered objects, a table of their byte offsets, and a trailer with the offset
        of this table. Object 1 is the catalog, object 2 the list of pages, object 3 the page, and object 4 its content.
        """
        content = zlib.compress("\n".join(self._operators).encode("ascii"), 9)  # 9 is the strongest compression
        media_box = f"/MediaBox [0 0 {width * POINTS:.2f} {height * POINTS:.2f}]".encode("ascii")
        bodies = (
            b"<< /Type /Catalog /Pages 2 0 R >>",
            b"<< /Type /Pages /Kids [3 0 R] /Count 1 >>",
            b"<< /Type /Page /Parent 2 0 R %s /Resources << >> /Contents 4 0 R >>" % media_box,
            b"<< /Length %d /Filter /FlateDecode >>\nstream\n%s\nendstream" % (len(content), content),
        )
        file = b"%PDF-1.4\n"
        offsets = []
        for number, body in enumerate(bodies, start=1):
            offsets.append(len(file))  # the object begins at the present end of the file
            file += b"%d 0 obj\n%s\nendobj\n" % (number, body)
        count = len(bodies) + 1  # including object 0, the head of the list of free objects
        table = b"".join(b"%010d 00000 n \n" % offset for offset in offsets)
        table_header = b"xref\n0 %d\n0000000000 65535 f \n" % count
        # A reader starts at the end of the file, where it finds the offset of the table.
        trailer = b"trailer\n<< /Size %d /Root 1 0 R >>\nstartxref\n%d\n%%%%EOF\n" % (count, len(file))
        return file + table_header + table + trailer

    def draw_point(self, pos: Vec2, properties: BackendProperties) -> None:
        """Draw a point as a line of zero length, which is visible because line caps are round."""
        self.draw_line(pos, pos, properties)

    def draw_line(self, start: Vec2, end: Vec2, properties: BackendProperties) -> None:
        """Draw a straight line between two points of the drawing [mm]."""
        self._stroke(f"{self._coordinates(start)} m {self._coordinates(end)} l", properties)

    def draw_solid_lines(self, lines: Iterable[tuple[Vec2, Vec2]], properties: BackendProperties) -> None:
        """Draw straight lines, each given by its two ends [mm]."""
        for start, end in lines:
            self.draw_line(start, end, properties)

    def draw_path(self, path: BkPath2d, properties: BackendProperties) -> None:
        """Draw a line along a path of straight and curved segments."""
        self._stroke(self._path_operators(path), properties)

    def draw_filled_paths(self, paths: Iterable[BkPath2d], properties: BackendProperties) -> None:  # noqa: ARG002
        """Fill the area inside outlines by the even-odd rule, so that holes stay empty."""
        outlines = [f"{self._path_operators(path)} h" for path in paths if len(path)]
        if outlines:
            self._operators.append(" ".join([*outlines, "f*"]))

    def draw_filled_polygon(self, points: BkPoints2d, properties: BackendProperties) -> None:  # noqa: ARG002
        """Fill the polygon with these corners [mm]."""
        first, *following = points.vertices()
        lines = " ".join(f"{self._coordinates(point)} l" for point in following)
        self._operators.append(f"{self._coordinates(first)} m {lines} h f")

    def _coordinates(self, *points: Vec2) -> str:
        """Return the page coordinates of points of the drawing as text."""
        page_points = [self._unit * (Vec2(point) - self._corner) for point in points]
        return " ".join(f"{point.x:.2f} {point.y:.2f}" for point in page_points)

    def _stroke(self, path: str, properties: BackendProperties) -> None:
        """Draw a line along a path, which is given by its operators, with the line width in `properties`."""
        self._operators.append(f"{POINTS * properties.lineweight:.2f} w {path} S")

    def _path_operators(self, path: BkPath2d) -> str:
        """Return the operators that construct a path: m moves to a point, l draws a line, and c draws a curve.

        PDF has only cubic Bezier curves, so a quadratic curve is written as the equivalent cubic curve. The cubic
        control points are two thirds of the way from each end to the quadratic control point.
        """
        start = Vec2(path.start)
        operators = [f"{self._coordinates(start)} m"]
        for command in path.commands():
            end = Vec2(command.end)
            if isinstance(command, Curve3To):
                control = Vec2(command.ctrl)
                first_control, second_control = start.lerp(control, 2.0 / 3.0), end.lerp(control, 2.0 / 3.0)
                operators.append(f"{self._coordinates(first_control, second_control, end)} c")
            elif isinstance(command, Curve4To):
                operators.append(f"{self._coordinates(Vec2(command.ctrl1), Vec2(command.ctrl2), end)} c")
            elif isinstance(command, MoveTo):
                operators.append(f"{self._coordinates(end)} m")
            else:
                operators.append(f"{self._coordinates(end)} l")
            start = end
        return " ".join(operators)

"""The leaves of both springs: printed with the frame, or strips of sheet glued into it.

What differs stands in `Leaves`: the material, the thicknesses, how well they are known, and how they are held.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from sensor.design.parameters import END_ROOM_MM, PRINTED, Design
from sensor.design.processes import Process
from sensor.design.sheets import SHEETS, SoldSheet
from sensor.design.tip_mount import plate_depth
from sensor.quantity import COVERAGE, validation_error
from sensor.theory.creep import CreepLaw
from sensor.theory.leaf_spring import pair_length
from sensor.theory.strip_clamp import StripClamp, StripScatter, clamp_share
from sensor.theory.two_spring_law import Springs

FREE_LENGTH_MM = 0.1  # two sigma: what the gauge block between frame and shuttle leaves of the free length
GLUE_EDGE_MM = 0.1  # two sigma at each shoulder: how far the glue ends behind it or beyond it
GLUE_MM = 0.1  # on each face of a strip
GLUE_E_MPA = 2000.0  # two-part epoxy of usual strength, cured cold, 1.5 to 3 GPa
GLUE_POISSON = 0.36
GLUE_SCATTER = 0.4  # two sigma of its modulus, as a fraction
SOLID_MM = 1.5  # of the print above and below a slot
TARGET_SCATTER = 0.05  # of K, two sigma: the thinnest sheet that has it makes the smallest sensor
SHORTEST_LEAF = 5.0  # length over thickness: below it a leaf is a block, and its length no longer sets its stiffness
SHORTEST_STRIP = 20.0  # the same of a strip, which is thin
FILLET_STRAIN = 1.3  # fillet root over beam theory, 1.17 to 1.27 by FE of solid flexures
SHOULDER_STRAIN = 1.1  # of a strip at its shoulder over beam theory: soft glue lets it bend


@dataclass(frozen=True, kw_only=True)
class Leaves:
    """The leaves of both springs, low first: what they are made of, thicknesses [mm], and how well they are known.

    `made_of` has the numbers of their material; `accuracies_mm` are two sigma of the thicknesses. `strain_factor` is
    the strain at a root over that of a beam, `least_slenderness` the least length over thickness. `clamp` is None where
    leaves and frame are of one piece. An end of a strip counts as longer than it is by `gives_mm`. `sold_mm` are the
    thicknesses that sheets were sold as, None for printed leaves.
    """

    made_of: Process | SoldSheet
    thicknesses_mm: tuple[float, float]
    accuracies_mm: tuple[float, float]
    least_thickness_mm: float
    fillet_mm: float
    strain_factor: float
    least_slenderness: float
    clamp: StripClamp | None = None
    scatters: tuple[StripScatter, ...] = ()
    gives_mm: tuple[float, float] = (0.0, 0.0)
    sold_mm: tuple[float, float] | None = None

    @property
    def is_printed(self) -> bool:
        """Say whether leaves and frame are of one piece."""
        return self.clamp is None

    @property
    def is_one_sheet(self) -> bool:
        """Say whether the strips of both springs are cut from one sheet, so that they are off alike."""
        pairs = (self.sold_mm, self.thicknesses_mm, self.accuracies_mm)
        return all(pair is not None and pair[0] == pair[1] for pair in pairs)

    def causes(self, lengths: Sequence[float]) -> Iterator[tuple[str, tuple[float, float]]]:
        """Yield each cause of the scatter of strips: its name, and how far it moves both springs, two sigma [1].

        `lengths` are the free ones of the low and of the high spring [mm]. Printed leaves have none here.
        """
        each = [
            list(scatter.causes(length, give))
            for scatter, length, give in zip(self.scatters, lengths, self.gives_mm, strict=bool(self.scatters))
        ]
        for low, high in zip(*each, strict=True):
            if low.is_common or (low.name == "sheet thickness" and self.is_one_sheet):
                yield low.name, (low.size, high.size)
            else:
                yield f"low {low.name}", (low.size, 0.0)
                yield f"high {low.name}", (0.0, high.size)

    def scatter(self, lengths: Sequence[float]) -> tuple[float, float]:
        """Return how far the stiffnesses of the low and of the high spring of strips scatter, two sigma [1].

        `lengths` [mm] are as in `causes`.
        """
        low, high = zip(*(sizes for _, sizes in self.causes(lengths)), strict=True)
        return math.hypot(*low), math.hypot(*high)


def leaves_of(design: Design, springs: Springs) -> Leaves:
    """Return the leaves that a design asks for, whose springs shall have these stiffnesses [N/mm].

    Raises InputError where strips of no listed sheet can be clamped.
    """
    kind = design.print.leaves
    return printed_leaves(design.process) if kind == PRINTED else strip_leaves(design, SHEETS[kind], springs)


def printed_leaves(process: Process) -> Leaves:
    """Return leaves of one piece with the frame."""
    return Leaves(
        made_of=process,
        thicknesses_mm=process.leaf_thicknesses_mm,
        accuracies_mm=(process.accuracy_mm, process.accuracy_mm),
        least_thickness_mm=process.min_wall_mm,
        fillet_mm=process.fillet_mm,
        strain_factor=FILLET_STRAIN,
        least_slenderness=SHORTEST_LEAF,
    )


def strip_leaves(design: Design, sheet: SoldSheet, springs: Springs) -> Leaves:
    """Return strips of a sheet, of the thicknesses that a design names, of the best ones where it names none.

    The best is the thinnest sheet whose stiffness scatters by at most 5 % once it is weighed, else the one of the least
    scatter. Its leaves must fit `print.max_length_mm`, and the clamps must hold its ends.
    """
    process = design.process
    asked = design.print
    named = (asked.leaf_thickness_low_mm, asked.leaf_thickness_high_mm)
    measured = (asked.leaf_measured_low_mm, asked.leaf_measured_high_mm)
    rows = zip(named, springs.stiffnesses, strict=True)
    sold = [thickness or best_thickness(design, sheet, K) for thickness, K in rows]
    clamp = strip_clamp(design, sheet, min(sold))
    used = []
    known = []
    gives = []
    for thickness, weighed in zip(sold, measured, strict=True):
        clamp.check_length(thickness, process.E_MPa, process.poisson)
        used.append(weighed or thickness)
        known.append(sheet.tolerance(thickness) if weighed is None else sheet.weighed * weighed)
        gives.append(clamp.give(thickness, process.E_MPa, process.poisson))
    scatters = [strip_scatter(design, sheet, off / thickness) for off, thickness in zip(known, used, strict=True)]
    return Leaves(
        made_of=sheet,
        thicknesses_mm=(used[0], used[1]),
        accuracies_mm=(known[0], known[1]),
        least_thickness_mm=0.0,  # a measured sheet is checked against the one it was sold as
        fillet_mm=0.0,
        strain_factor=SHOULDER_STRAIN,
        least_slenderness=SHORTEST_STRIP,
        clamp=clamp,
        scatters=tuple(scatters),
        gives_mm=(gives[0], gives[1]),
        sold_mm=(sold[0], sold[1]),
    )


def check_clamps(design: Design) -> None:
    """Raise InputError where the clamps of a design cannot hold strips of the thicknesses that it names, or of any."""
    asked = design.print
    if asked.leaves == PRINTED:
        return
    sheet = SHEETS[asked.leaves]
    process = design.process
    thinnest = min(sheet.thicknesses_mm)
    for thickness in (asked.leaf_thickness_low_mm or thinnest, asked.leaf_thickness_high_mm or thinnest):
        strip_clamp(design, sheet, thickness).check_length(thickness, process.E_MPa, process.poisson)


def strip_clamp(design: Design, sheet: SoldSheet, thinnest: float) -> StripClamp:
    """Return how a design holds strips, the thinnest of which has a thickness [mm].

    The slot of that one is no narrower than the least gap that the process keeps open.
    """
    process = design.process
    open_gap = math.ceil(1e3 * 0.5 * (process.min_gap_mm - thinnest) - 1e-6) / 1e3
    return StripClamp(
        length=design.clamp_mm,
        end_room=END_ROOM_MM,
        gap=max(GLUE_MM, open_gap),
        wall=max(SOLID_MM, process.min_wall_mm),
        corner=process.fillet_mm,
        strip_E_MPa=sheet.E_MPa,
        strip_poisson=sheet.poisson,
        strip_over_print_density=sheet.density_g_per_cm3 / process.density_g_per_cm3,
        glue_E_MPa=GLUE_E_MPA,
        glue_poisson=GLUE_POISSON,
    )


def best_thickness(design: Design, sheet: SoldSheet, K: float) -> float:
    """Return the listed thickness [mm] of the strips of a spring of stiffness K [N/mm]; raises InputError for none."""
    found = {}
    for thickness in sheet.thicknesses_mm:
        scatter = _scatter_weighed(design, sheet, thickness, K)
        if scatter is not None:
            found[thickness] = scatter
    if not found:
        bound = f"{PRINTED!r} where no strip of a listed sheet, glued in at its ends, is as stiff as {1e3 * K:.4g} N/m"
        raise validation_error("print.leaves", sheet.name, "", bound, "give other springs, or a longer print.clamp_mm")
    enough = [thickness for thickness, scatter in found.items() if scatter <= TARGET_SCATTER]
    return min(enough) if enough else min(found, key=lambda thickness: found[thickness])


def _scatter_weighed(design: Design, sheet: SoldSheet, thickness: float, K: float) -> float | None:
    """Return two sigma of K as a fraction, for a weighed sheet of a thickness [mm]; None where no such strip fits."""
    process = design.process
    clamp = strip_clamp(design, sheet, thickness)
    give = clamp.give(thickness, process.E_MPa, process.poisson)
    length = free_length(sheet.E_MPa, plate_depth(design, process), thickness, K, give)
    longest = design.print.max_length_mm
    if not max(SHORTEST_STRIP * thickness, clamp.length) < length <= longest or not clamp.holds(give):
        return None
    known = strip_scatter(design, sheet, sheet.weighed)
    return math.hypot(*(cause.size for cause in known.causes(length, give)))


def free_length(E: float, depth: float, thickness: float, K: float, give: float) -> float:
    """Return the free length [mm] at which a pair of strips has a stiffness K [N/mm], each end 1 / beta longer."""
    return pair_length(E, depth, thickness, K) - 2.0 * give


def beam_lengths(design: Design, leaves: Leaves, springs: Springs) -> tuple[float, ...]:
    """Return the lengths of both leaves [mm] by the beam law, for stiffnesses of the springs [N/mm]."""
    depth = plate_depth(design, design.process)
    rows = zip(leaves.thicknesses_mm, springs.stiffnesses, leaves.gives_mm, strict=True)
    return tuple(free_length(leaves.made_of.E_MPa, depth, thickness, K, give) for thickness, K, give in rows)


def strip_scatter(design: Design, sheet: SoldSheet, thickness: float) -> StripScatter:
    """Return how well the strips of a design are known, their thickness as a fraction of it, all two sigma."""
    return StripScatter(
        thickness=thickness,
        modulus=COVERAGE * sheet.E_scatter,
        width=sheet.width_mm / plate_depth(design, design.process),
        length=FREE_LENGTH_MM,
        glue_edge=GLUE_EDGE_MM,
        print_modulus=COVERAGE * design.process.E_scatter,
        glue_modulus=GLUE_SCATTER,
    )


def stiffness_per_K(leaves: Leaves, process: Process, lengths: Sequence[float]) -> float | None:
    """Return the largest change of a spring's stiffness by the temperature [1/K], for its leaves' lengths [mm].

    Strips change as their steel does, and by their share as the print does, whose glue is taken alike.
    """
    of_leaves = leaves.made_of.E_per_K
    if leaves.is_printed or of_leaves is None or process.E_per_K is None:
        return of_leaves
    changes = []
    for length, give in zip(lengths, leaves.gives_mm, strict=True):
        share = clamp_share(length, give)
        changes.append((1.0 - share) * of_leaves + share * process.E_per_K)
    return max(changes, key=abs)


def creep_of(leaves: Leaves, process: Process, lengths: Sequence[float]) -> CreepLaw:
    """Return the creep of springs by the free lengths of their leaves [mm], low first.

    Strips of steel do not creep; what clamps them does, by its share. Shares of both springs differ, and one law
    stands for both: half of that difference is in its deviation. Glue is taken to creep as the print does.
    """
    creep = process.creep
    if leaves.is_printed:
        return creep
    low, high = (clamp_share(length, give) for length, give in zip(lengths, leaves.gives_mm, strict=True))
    share = 0.5 * (low + high)
    deviation = math.hypot(share * creep.error, 0.5 * (high - low) * creep.per_decade)
    return CreepLaw(share * creep.per_decade, deviation)

"""The public names with the module that each is defined in; `__init__.py` reads this table too."""

from instrument.calibrate.calibration import Calibration as Calibration
from instrument.calibrate.calibration import calibrate as calibrate
from instrument.compress.force_law import TestGeometry as TestGeometry
from instrument.compress.modulus import CompressionResult as CompressionResult
from instrument.compress.modulus import modulus as modulus
from instrument.compress.pressed_shapes import CylinderOnEnd as CylinderOnEnd
from instrument.compress.pressed_shapes import CylinderOnSide as CylinderOnSide
from instrument.compress.pressed_shapes import Ellipsoid as Ellipsoid
from instrument.compress.pressed_shapes import Plunger as Plunger
from instrument.compress.pressed_shapes import RectangularBlock as RectangularBlock
from instrument.firmware.firmware import c_header as c_header
from instrument.firmware.firmware import micropython as micropython
from instrument.press.fruit_reading import FruitReading as FruitReading
from instrument.press.presses import read_press as read_press
from instrument.press.printed_unit import PrintedUnit as PrintedUnit
from pipeline.main_job import evaluate as evaluate
from pipeline.main_job import run as run
from pipeline.making.in_cadquery import assembly as assembly
from pipeline.making.in_cadquery import cover as cover
from pipeline.making.in_cadquery import housing as housing
from pipeline.making.in_cadquery import mount as mount
from pipeline.options import RunOptions as RunOptions
from pipeline.options import load_design as load_design
from pipeline.report.report import Report as Report
from pipeline.report.report import read_report as read_report
from pipeline.result import SensorResult as SensorResult
from pipeline.springs.own_part import PartStiffness as PartStiffness
from pipeline.springs.own_part import stiffness as stiffness
from pipeline.study.engines import process_engine as process_engine
from pipeline.study.execute import StudySummary as StudySummary
from pipeline.study.execute import run_study as run_study
from pipeline.study.study_file import Study as Study
from pipeline.study.study_file import read_study as read_study
from sensor.design.parameters import Design as Design
from sensor.quantity import InputError as InputError
from sensor.theory.two_spring_law import Springs as Springs
from sensor.theory.two_spring_law import force_ratio as force_ratio
from sensor.theory.two_spring_law import fruit_stiffness as fruit_stiffness
from sensor.theory.two_spring_law import size_springs as size_springs
from sensor.verdict import Verdict as Verdict

__version__: str

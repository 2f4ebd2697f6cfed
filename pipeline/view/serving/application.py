"""The page that a browser shows: the picture that this machine draws, and the controls beside it."""

import asyncio
from pathlib import Path
from typing import Any

import pyvista as pv
from trame.app import get_server
from trame.widgets import html
from trame_vtk.widgets import vtk
from trame_vuetify.ui.vuetify3 import SinglePageWithDrawerLayout
from trame_vuetify.widgets import vuetify3
from vtkmodules.vtkRenderingCore import vtkCellPicker

from pipeline.report.stored import StoredReport
from pipeline.view.serving.served_scenes import AXES, Probe, ServedScenes, View, chosen_field

Item = dict[str, object]  # of a list: its title and its value
Server = Any  # of trame, whose attributes have no types that strict mode takes

_STEPS = 40  # of a slider
_REST = 0.25  # seconds without a change
_FIRST_SIZE = (980, 770)  # of the picture [pixels], before a browser tells its own
_FACTORS = (0.0, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0)


class Application:
    """The state of the page, and what is drawn when it changes."""

    def __init__(self, report: StoredReport, folder: Path, name: str) -> None:
        """Solve the housing under unit loads and draw the first scene; raises InputError, SolveError."""
        self.scenes = ServedScenes(report, folder)
        self.server: Server = get_server(name, client_type="vue3")
        self.plotter = _plotter()
        self.plotter.set_background("white")
        self._drawn: View | None = None
        self._waiting: asyncio.TimerHandle | None = None
        moduli = [row.E_MPa for row in report.response]
        self.server.state.update(
            {
                "trame__title": f"twintip: {report.design.name}",
                "scene": self.scenes.names[0],
                "field": "",
                "fields": [],
                "E_MPa": max(moduli),
                "x_mm": report.design.press.travel_mm,
                "factor": 0.0,
                "cut_axis": "",
                "cut_at": 0.5,
                "probe_x": 0.0,
                "probe_y": 0.0,
                "probe_z": 0.0,
                "probe": "",
                "message": "",
            }
        )
        self._lay_out(report, moduli)
        self.server.state.change("scene", "field", "E_MPa", "x_mm", "factor", "cut_axis", "cut_at")(
            self._wait_to_redraw
        )
        self.plotter.iren.interactor.AddObserver("LeftButtonPressEvent", self.pick)
        self.redraw()

    @property
    def view(self) -> View:
        """Return the view that the controls ask for."""
        state = self.server.state
        return View(
            scene=state.scene,
            field=state.field or "",
            E_MPa=float(state.E_MPa),
            x_mm=float(state.x_mm),
            factor=float(state.factor),
            cut_axis=state.cut_axis or "",
            cut_at=float(state.cut_at),
        )

    def _wait_to_redraw(self, **_: object) -> None:
        """Draw when the controls have come to rest: a slider that is dragged passes many values."""
        if self._waiting is not None:
            self._waiting.cancel()
        self._waiting = asyncio.get_running_loop().call_later(_REST, self._redraw_at_rest)

    def _redraw_at_rest(self) -> None:
        with self.server.state:
            self.redraw()

    def redraw(self) -> None:
        """Draw what the controls ask for; the eye stays where it is while the scene stays."""
        view, state = self.view, self.server.state
        if view == self._drawn:
            return
        camera = self.plotter.camera.copy() if self._drawn and self._drawn.scene == view.scene else None
        state.message = self.scenes.draw(self.plotter, view) or ""
        if camera is not None:
            self.plotter.camera = camera
        scene = None if state.message else self.scenes.field_scene(view)
        state.fields = [] if scene is None else [{"title": one.title, "value": one.array} for one in scene.fields]
        if scene is not None:
            state.field = chosen_field(scene, view).array
        self._drawn = self.view
        self.plotter.render()
        self.server.controller.view_update()

    def probe(self) -> None:
        """Say the value at the place that was typed."""
        state = self.server.state
        place = (float(state.probe_x), float(state.probe_y), float(state.probe_z))
        self._say(self.scenes.probed(self.view, place))

    def pick(self, *_: object) -> None:
        """Say the value where the body was pressed on in the picture."""
        picker = vtkCellPicker()
        across, up = self.plotter.iren.interactor.GetEventPosition()
        if picker.Pick(across, up, 0.0, self.plotter.renderer):
            with self.server.state:
                self._say(self.scenes.picked(self.view, picker.GetPickPosition()))

    def _say(self, probe: Probe) -> None:
        state = self.server.state
        place = ", ".join(f"{coordinate:.4g}" for coordinate in probe.place)
        title = next((field["title"] for field in state.fields if field["value"] == state.field), "")
        value = "outside the body" if probe.value is None else f"{title} {probe.value:.5g}"
        state.probe = f"at ({place}) mm before the press: {value}"

    def _lay_out(self, report: StoredReport, moduli: list[float]) -> None:
        """Lay out the picture with the controls beside it."""
        with SinglePageWithDrawerLayout(self.server, full_height=True) as layout:
            layout.footer.hide()
            layout.title.set_text(f"twintip: {report.design.name}")
            with layout.drawer, vuetify3.VContainer():
                self._lay_out_choices(report, moduli)
                self._lay_out_probe()
            with layout.content, vuetify3.VContainer(fluid=True, classes="pa-0 fill-height"):
                view = vtk.VtkRemoteView(self.plotter.render_window, interactive_ratio=1)
                self.server.controller.view_update = view.update

    def _lay_out_choices(self, report: StoredReport, moduli: list[float]) -> None:
        """Lay out what is shown, under which press, and how it is drawn."""
        travel = report.design.press.travel_mm
        factors: list[Item] = [{"title": f"{each:g}" if each else "as fits", "value": each} for each in _FACTORS]
        _choice("Scene", "scene", [{"title": name, "value": name} for name in self.scenes.names])
        vuetify3.VSelect(label="Field", v_model=("field",), items=("fields",), density="compact")
        _slider("E of the fruit [MPa]", "E_MPa", min(moduli), max(moduli))
        _slider("travel [mm]", "x_mm", travel / _STEPS, travel)
        _choice("Displacements drawn, times", "factor", factors)
        _choice("Cut across", "cut_axis", [{"title": name or "as is", "value": name} for name in ("", *AXES)])
        _slider("cut at, share of the body", "cut_at", 0.01, 0.99)

    def _lay_out_probe(self) -> None:
        """Lay out the place whose value is asked for, and the answer."""
        with html.Div(style="display: flex; gap: 0.3rem"):
            for axis in AXES:
                vuetify3.VTextField(label=f"{axis} [mm]", v_model=(f"probe_{axis}",), type="number", density="compact")
        vuetify3.VBtn("Value there", click=self.probe, block=True, classes="probe")
        html.P("{{ probe }}", classes="probed mt-3")
        html.P("{{ message }}", classes="text-error", role="alert")


def _plotter() -> Any:  # noqa: ANN401 - a PyVista plotter
    return pv.Plotter(off_screen=True, window_size=list(_FIRST_SIZE))


def _choice(label: str, key: str, items: list[Item]) -> None:
    vuetify3.VSelect(label=label, v_model=(key,), items=(f"{key}_items", items), density="compact")


def _slider(label: str, key: str, least: float, largest: float) -> None:
    """Lay out a slider with its number above it."""
    html.Label(f"{label}: {{{{ Number({key}).toPrecision(3) }}}}")
    vuetify3.VSlider(
        v_model=(key,),
        min=least,
        max=largest,
        step=(largest - least) / _STEPS if largest > least else 1.0,
        density="compact",
        hide_details=True,
        classes=f"slider-{key}",
    )

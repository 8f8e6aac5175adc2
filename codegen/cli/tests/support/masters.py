"""Both units of a spec connected under several masters, which must give the same bytes tick by tick. Every unit steps on what the other gave
a step before, as these masters do it.

    specgen export fmu specs/reference.toml -o units --plant
    pip install fmpy ecospy libcosimpy        # ecospy wants libtbb12
    python codegen/cli/tests/support/masters.py units/reference 6000
"""

import hashlib
import struct
import sys
from pathlib import Path

from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave


class Units:
    """Controller and plant: files, variables, what connects them, and what moves the controller in a tick."""

    def __init__(self, stem: str) -> None:
        self.paths = [f"{stem}.fmu", f"{stem}_plant.fmu"]
        self.about = [read_model_description(path) for path in self.paths]
        self.period = float(self.about[0].defaultExperiment.stepSize)
        self.own, self.plants = [{v.name: v.valueReference for v in about.modelVariables} for about in self.about]
        given = {v.name for v in self.about[1].modelVariables if v.causality == "output"}
        inputs = [v.name for v in self.about[0].modelVariables if v.causality == "input"]
        outputs = [v for v in self.about[0].modelVariables if v.causality == "output"]
        self.readings = [name for name in inputs if name in given]
        self.voltages = [f"voltage[{leg}]" for leg in range(6)]
        self.setpoints = [name for name in inputs if name.startswith("setpoint")]
        self.reals = [v.name for v in outputs if v.type == "Real"]
        self.integers = [v.name for v in outputs if v.type != "Real"]

    def request(self, tick: int) -> int:
        return (tick > 5) + (tick > 4000)

    def setpoint(self, tick: int) -> float:
        return 1e-8 * ((tick % 997) / 997 - 0.5)

    def row(self, reals, integers, readings) -> bytes:
        sizes = len(reals), len(integers), len(readings)
        return struct.pack("={}d{}i{}d".format(*sizes), *reals, *integers, *readings)


def under_fmpy(units: Units, ticks: int):
    def instance(path, about):
        unit = FMU2Slave(
            guid=about.guid,
            unzipDirectory=extract(path),
            modelIdentifier=about.coSimulation.modelIdentifier,
            instanceName=about.modelName,
        )
        unit.instantiate()
        unit.setupExperiment(startTime=0.0)
        unit.enterInitializationMode()
        unit.exitInitializationMode()
        return unit

    controller, plant = map(instance, units.paths, units.about)
    of = lambda table, names: [table[name] for name in names]
    for tick in range(ticks):
        seen = plant.getReal(of(units.plants, units.readings))
        volts = controller.getReal(of(units.own, units.voltages))
        controller.setReal(of(units.own, units.readings), seen)
        plant.setReal(of(units.plants, units.voltages), volts)
        controller.setInteger([units.own["request"]], [units.request(tick)])
        controller.setReal(of(units.own, units.setpoints), [units.setpoint(tick)] * len(units.setpoints))
        for unit in (controller, plant):
            unit.doStep(tick * units.period, units.period)
        yield units.row(
            controller.getReal(of(units.own, units.reals)),
            controller.getInteger(of(units.own, units.integers)),
            plant.getReal(of(units.plants, units.readings)),
        )


def under_ecos(units: Units, ticks: int):
    from ecospy import EcosSimulation, EcosSimulationStructure

    structure = EcosSimulationStructure()
    for name, path in zip(("controller", "plant"), units.paths):
        structure.add_model(name, path)
    for name in units.readings:
        structure.make_real_connection(f"plant::{name}", f"controller::{name}")
    for name in units.voltages:
        structure.make_real_connection(f"controller::{name}", f"plant::{name}")
    master = EcosSimulation(units.period, structure=structure)
    master.init()
    for tick in range(ticks):
        master.set_integer("controller::request", units.request(tick))
        for name in units.setpoints:
            master.set_real(f"controller::{name}", units.setpoint(tick))
        master.step()
        yield units.row(
            [master.get_real(f"controller::{name}") for name in units.reals],
            [master.get_integer(f"controller::{name}") for name in units.integers],
            [master.get_real(f"plant::{name}") for name in units.readings],
        )
    master.terminate()


def under_libcosim(units: Units, ticks: int):
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimManipulator import CosimManipulator
    from libcosimpy.CosimObserver import CosimObserver
    from libcosimpy.CosimSlave import CosimLocalSlave

    master = CosimExecution.from_step_size(round(units.period * 1e9))
    controller, plant = [master.add_local_slave(CosimLocalSlave(path, Path(path).stem)) for path in units.paths]
    for name in units.readings:
        master.connect_real_variables(plant, units.plants[name], controller, units.own[name])
    for name in units.voltages:
        master.connect_real_variables(controller, units.own[name], plant, units.plants[name])
    given, seen = CosimManipulator.create_override(), CosimObserver.create_last_value()
    master.add_manipulator(given)
    master.add_observer(seen)
    setpoints = [units.own[name] for name in units.setpoints]
    for tick in range(ticks):
        given.slave_integer_values(controller, [units.own["request"]], [units.request(tick)])
        given.slave_real_values(controller, setpoints, [units.setpoint(tick)] * len(setpoints))
        assert master.step()
        yield units.row(
            seen.last_real_values(controller, [units.own[name] for name in units.reals]),
            seen.last_integer_values(controller, [units.own[name] for name in units.integers]),
            seen.last_real_values(plant, [units.plants[name] for name in units.readings]),
        )


def main(stem: str, ticks: int) -> None:
    units = Units(stem)
    rows = {run.__name__: list(run(units, ticks)) for run in (under_fmpy, under_ecos, under_libcosim)}
    wanted = rows["under_fmpy"]
    assert len(set(wanted)) > ticks // 2, "nothing moves"
    for name, found in rows.items():
        differing = sum(a != b for a, b in zip(found, wanted, strict=True))
        print(f"{name}: {differing} of {ticks} ticks differ, SHA-256 {hashlib.sha256(b''.join(found)).hexdigest()[:16]}")
        assert differing == 0


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]))

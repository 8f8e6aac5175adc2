"""The free client qmi, its driver PI_E873 of a single stage, unchanged, against `specgen gcs --axis 1=Z` at the port of the first argument."""

import sys

import qmi
from qmi.core.exceptions import QMI_InstrumentException
from qmi.instruments.pi import PI_E873

LIMIT = 20.0


def refused(code, call, *arguments):
    """Whether the stage answers a call with this code, and nothing moves."""
    before = stage.get_target_position()
    try:
        call(*arguments)
    except QMI_InstrumentException as error:
        assert f"error {code} " in str(error), error
        assert stage.get_target_position() == before
        return True
    return False


qmi.start("specgen-test", console_loglevel="CRITICAL")
with qmi.make_instrument("stage", PI_E873, f"tcp:127.0.0.1:{sys.argv[1]}") as stage:
    assert stage.get_idn().vendor == "specgen" and stage.get_physical_unit() == "um"
    low, high = stage.get_position_range()
    assert -10 < low < -9 and 41.9 < high < 42.1, (low, high)
    assert refused(5, stage.move_absolute, 1.0)
    stage.set_servo_mode(True)
    stage.reference_move()
    assert stage.wait_motion_complete(LIMIT) and stage.get_servo_mode() and stage.get_reference_result()
    worst = 0.0
    for count in range(100):
        to = count * 37 % 41 * 0.5 - 5.0
        stage.move_absolute(to)
        assert stage.wait_motion_complete(LIMIT)
        status = stage.get_system_status()
        assert status.on_target and status.servo_mode and not status.error_flag, status
        assert stage.get_target_position() == to
        worst = max(worst, abs(stage.get_position() - to))
    assert worst < 0.05, worst
    stage.move_relative(0.5)
    assert stage.wait_motion_complete(LIMIT) and stage.get_target_position() == to + 0.5
    assert refused(7, stage.move_absolute, 500.0) and refused(7, stage.move_absolute, -20.0)
    stage.move_absolute(40.0)
    while stage.get_position() < 20.0:
        pass
    stage.stop_smooth()
    assert stage.wait_motion_complete(LIMIT) and stage.get_target_position() < 39.0
    stage.stop_all()
    assert abs(stage.get_velocity() - stage.get_max_velocity()) < 1e-6
    stage.set_servo_mode(False)
    assert refused(5, stage.move_absolute, 1.0)
    print(f"qmi {qmi.__version__}: 100 moves, {1e3 * worst:.1f} nm from the target at most")
qmi.stop()

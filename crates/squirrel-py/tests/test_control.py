"""Control laws and the whole flight code."""

import numpy as np
import pytest

import squirrel


def replayed(log: squirrel.FlightLog, stack: squirrel.Stack, steps: int, copies: int = 1) -> dict[str, np.ndarray]:
    """The first steps of a log's inputs through the flight code."""

    def at(channel: str, time_s: float) -> np.ndarray | None:
        (found,) = np.nonzero(log.time_s(channel.rpartition(".")[0]) == time_s)
        if not found.size:
            return None
        row = log[channel][found[0]].astype(np.float32)
        return np.repeat(row[None], copies, axis=0)

    outputs: dict[str, list[np.ndarray]] = {}
    for time_s, time_us in zip(log.time_s("frame")[:steps], log["frame.time_us"], strict=False):
        output = stack.step(
            time_us=int(time_us),
            omega_body_rad_s=at("imu.omega_body_rad_s", time_s),
            specific_force_body_m_s2=at("imu.specific_force_body_m_s2", time_s),
            q_ned_from_body_wxyz=at("attitude.q_ned_from_body_wxyz", time_s),
            position_ned_m=at("gnss.position_ned_m", time_s),
            velocity_ned_m_s=at("gnss.velocity_ned_m_s", time_s),
            altitude_m=at("baro.altitude_m", time_s),
        )
        for name, rows in output.items():
            outputs.setdefault(name, []).append(rows)
    return {name: np.stack(rows) for name, rows in outputs.items()}


def test_the_stack_gives_the_bits_of_the_flight() -> None:
    # A stack step by step takes one inertial unit, and attitude from outside.
    log = squirrel.simulate(scenario="track", arm="twcc_flat", seed=2, estimator="oracle")
    stack = squirrel.Stack(arm="twcc_flat", scenario="track", seed=2, count=3)
    outputs = replayed(log, stack, 600, copies=3)
    for vehicle in range(3):
        np.testing.assert_array_equal(outputs["rotor_command"][:, vehicle], log["rotor.command"][:600])
        np.testing.assert_array_equal(outputs["wing_command"][:, vehicle], log["wing.command"][:600])
    assert (outputs["failsafe_mode"] == 0).all()


def test_a_copy_of_the_stack_goes_on_by_itself() -> None:
    log = squirrel.simulate(scenario="hover", seed=2)
    stack = squirrel.Stack(scenario="hover", seed=2)
    replayed(log, stack, 50)
    copy = stack.copy()
    ahead = copy.step(time_us=10_000_000)
    assert ahead["failsafe_mode"][0] == 2
    stack.reset()
    assert stack.step(time_us=0)["failsafe_mode"][0] == 0


def test_what_is_not_finite_is_the_flight_codes_to_refuse() -> None:
    stack = squirrel.Stack(count=2)
    level = np.array([[1, 0, 0, 0], [np.nan, 0, 0, 0]], np.float32)
    rates = np.zeros((2, 3), np.float32)
    output = stack.step(
        time_us=0, q_ned_from_body_wxyz=level, omega_body_rad_s=rates, specific_force_body_m_s2=rates
    )
    np.testing.assert_array_equal(output["rejected"], [0, 1])
    assert np.isfinite(output["torque_n_m"][0]).all() and np.isnan(output["torque_n_m"][1]).all()
    with pytest.raises(ValueError, match="specific_force_body_m_s2: missing, but there is omega_body_rad_s"):
        stack.step(time_us=1, omega_body_rad_s=rates)
    with pytest.raises(ValueError, match=r"altitude_m: expected a float32 array of shape \(2,\)"):
        stack.step(time_us=1, altitude_m=np.zeros((2, 1), np.float32))


def test_backstepping_turns_back_to_level(vehicle: squirrel.Vehicle) -> None:
    law = squirrel.control.Backstepping(vehicle, count=2)
    roll = np.array([[np.cos(0.1), np.sin(0.1), 0, 0]], np.float32)
    rolled = np.concatenate([roll, -roll])
    zero = np.zeros((2, 3), np.float32)
    terms = law.step(q_ned_from_body_wxyz=rolled, omega_body_rad_s=zero, angle_rad=zero, dt_s=1 / 300)
    assert set(terms) == {
        "angle_error_rad", "rate_error_rad_s", "integral_rad_s", "gyroscopic_torque_n_m", "torque_n_m",
    }  # fmt: skip
    assert (terms["torque_n_m"][:, 0] < 0).all() and terms["torque_n_m"].dtype == np.float32
    # A quaternion and its negative are one attitude.
    np.testing.assert_allclose(terms["torque_n_m"][0], terms["torque_n_m"][1], rtol=1e-6)
    again = law.step(q_ned_from_body_wxyz=rolled, omega_body_rad_s=zero, angle_rad=zero, dt_s=1 / 300)
    assert (again["integral_rad_s"][:, 0] != terms["integral_rad_s"][:, 0]).all()
    law.reset()
    fresh = law.step(q_ned_from_body_wxyz=rolled, omega_body_rad_s=zero, angle_rad=zero, dt_s=1 / 300)
    np.testing.assert_array_equal(fresh["integral_rad_s"], terms["integral_rad_s"])
    with pytest.raises(ValueError, match=r"q_ned_from_body_wxyz\[0, 0:4\]: norm 0, must be 1"):
        law.step(q_ned_from_body_wxyz=0 * rolled, omega_body_rad_s=zero, angle_rad=zero, dt_s=1 / 300)
    with pytest.raises(ValueError, match="dt_s = -1: must be finite and > 0"):
        law.step(q_ned_from_body_wxyz=rolled, omega_body_rad_s=zero, angle_rad=zero, dt_s=-1.0)


def test_twcc_holds_a_hover() -> None:
    log = squirrel.simulate(scenario="hover", arm="twcc_flat", seed=1)
    law = squirrel.control.Twcc(squirrel.Vehicle.bundled("squirrel"), arm="twcc_flat")
    down = np.float32(log["reference.position_ned_m"][0, 2])
    terms = law.step(
        position_ned_m=np.array([[0, 0, down]], np.float32),
        velocity_ned_m_s=np.zeros((1, 3), np.float32),
        q_ned_from_body_wxyz=np.array([[1, 0, 0, 0]], np.float32),
        reference_position_ned_m=np.array([[0, 0, down]], np.float32),
    )
    np.testing.assert_array_equal(terms["roll_pitch_command_rad"], [[0, 0]])
    assert abs(terms["thrust_command_n"][0] - 0.548 * 9.80665) < 1e-3
    assert terms["wing_command"][0] == 0 and terms["mode"][0] == 0


def test_control_needs_gains_and_vehicles() -> None:
    bare = squirrel.Vehicle.bundled("crazyflie2_arpl")
    for make in (squirrel.control.Backstepping, squirrel.control.Twcc, squirrel.Stack):
        with pytest.raises(ValueError, match=r"\[control\] is missing"):
            make(bare)
        with pytest.raises(ValueError, match="count = 0: must be at least 1"):
            make(squirrel.Vehicle.bundled("squirrel"), count=0)

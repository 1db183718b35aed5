"""Gymnasium's own checks, and what ours promise beyond them."""

import pickle

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import squirrel
import squirrel.envs

NAMES = ["SquirrelAvoid-v0", "SquirrelTrack-v0"]
LEVELS = ["motor", "body_rate", "attitude_wing"]


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("action", LEVELS)
def test_gymnasium_finds_nothing_to_complain_about(name: str, action: str) -> None:
    env = gymnasium.make(name, action=action)
    check_env(env.unwrapped, skip_render_check=True)
    env.close()


@pytest.mark.parametrize("name", NAMES)
def test_a_vectorised_environment_is_single_ones_to_the_bit(name: str) -> None:
    rng = np.random.default_rng(0)
    envs = gymnasium.make_vec(name, num_envs=5, episode_s=0.5)
    singles = [gymnasium.make(name, episode_s=0.5) for _ in range(5)]
    seen, _ = envs.reset(seed=11)
    alone = [env.reset(seed=11 + k)[0] for k, env in enumerate(singles)]
    assert np.array_equal(seen, np.stack(alone))
    ended = np.zeros(5, bool)
    for _ in range(60):
        actions = rng.uniform(-0.3, 0.3, (5, 4)).astype(np.float32)
        seen, reward, terminated, truncated, _ = envs.step(actions)
        for k, env in enumerate(singles):
            if ended[k]:
                observation, _ = env.reset()
                assert np.array_equal(seen[k], observation) and reward[k] == 0.0
                ended[k] = False
                continue
            one = env.step(actions[k])
            assert np.array_equal(seen[k], one[0])
            assert (reward[k], terminated[k], truncated[k]) == one[1:4]
            ended[k] = terminated[k] or truncated[k]
    assert envs.metadata["autoreset_mode"] is gymnasium.vector.AutoresetMode.NEXT_STEP


def test_seeds_decide_everything() -> None:
    def flown(seed: int) -> list[np.ndarray]:
        envs = gymnasium.make_vec("SquirrelAvoid-v0", num_envs=3, sensors=True)
        envs.action_space.seed(0)
        return [envs.reset(seed=seed)[0], *(envs.step(envs.action_space.sample())[0] for _ in range(50))]

    assert all(np.array_equal(a, b) for a, b in zip(flown(3), flown(3), strict=True))
    assert not np.array_equal(flown(3)[0], flown(4)[0])


def test_the_mask_says_who_begins_anew() -> None:
    envs = gymnasium.make_vec("SquirrelTrack-v0", num_envs=3)
    first, _ = envs.reset(seed=1)
    second, _ = envs.reset(options={"reset_mask": np.array([False, True, False])})
    assert np.array_equal(first[[0, 2]], second[[0, 2]]) and not np.array_equal(first[1], second[1])


def test_domain_randomisation_is_a_list_of_vehicles() -> None:
    plain = squirrel.Vehicle.bundled("squirrel")
    heavy = plain.edited({"effects.mass_error.mass_fraction": 0.3})
    envs = squirrel.envs.SquirrelVectorEnv(task="track", num_envs=200, vehicles=[plain, heavy])
    envs.reset(seed=0)
    start = envs.tasks.states()[0][:, 2]
    for _ in range(20):
        envs.step(np.tile(np.float32([0, 0, 0, -1]), (200, 1)))
    velocity = envs.tasks.states()[0][:, 5]
    assert len(start) == 200 and np.ptp(velocity) > 0.5, "some sink, some do not"


def test_bad_arguments_are_named() -> None:
    envs = gymnasium.make_vec("SquirrelTrack-v0", num_envs=2)
    envs.reset(seed=0)
    for actions, words in [
        (np.zeros((2, 5), np.float32), "actions: expected a float32 array of shape (2, 4), got shape (2, 5)"),
        (np.full((2, 4), np.nan, np.float32), "actions[0, 0] = NaN: must be finite"),
    ]:
        with pytest.raises(ValueError) as error:
            envs.step(actions)
        assert words in str(error.value)
    vehicles = [squirrel.Vehicle.bundled("squirrel")]
    for arguments, words in [
        ({"task": "fly"}, "task = fly: must be avoid or track"),
        ({"task": "avoid", "action": "pwm"}, "action = pwm"),
        ({"task": "avoid", "num_envs": 0}, "num_envs = 0: must be at least 1"),
        ({"task": "avoid", "episode_s": float("nan")}, "episode_s = NaN"),
    ]:
        with pytest.raises(ValueError) as error:
            squirrel.Tasks(vehicles=vehicles, **arguments)
        assert words in str(error.value)


def test_a_wrapper_of_gymnasium_fits() -> None:
    envs = gymnasium.wrappers.vector.RecordEpisodeStatistics(
        gymnasium.make_vec("SquirrelTrack-v0", num_envs=4, episode_s=0.2)
    )
    envs.reset(seed=0)
    infos = [envs.step(np.zeros((4, 4), np.float32))[4] for _ in range(12)]
    assert any("episode" in info for info in infos)
    assert pickle.loads(pickle.dumps(envs.single_action_space)) == envs.single_action_space


@pytest.mark.parametrize("name", NAMES)
def test_info_has_what_rewards_are_made_of(name: str) -> None:
    envs = gymnasium.make_vec(name, num_envs=4, action="motor", episode_s=3.0)
    single = gymnasium.make(name, action="motor", episode_s=3.0)
    envs.reset(seed=5)
    single.reset(seed=5)
    parts = ["reward_near", "reward_turning", "reward_lost"]
    lost = 0
    for _ in range(150):
        actions = np.full((4, 5), -0.2, np.float32)
        actions[1:, 0] = 0.4
        states, references = envs.unwrapped.tasks.states()
        _, reward, terminated, _, info = envs.step(actions)
        assert list(info) == parts
        np.testing.assert_allclose(sum(info[part] for part in parts), reward, atol=1e-7)
        assert np.array_equal(info["reward_lost"] == -5.0, terminated)
        states, references = envs.unwrapped.tasks.states()
        away = np.linalg.norm(states[:, :3] - references, axis=1)
        near = (1.0 - away / 5.0) / 50.0
        turning = -0.005 * (states[:, 10:13] ** 2).sum(axis=1) / 50.0
        flies = (reward != 0.0) & ~terminated
        np.testing.assert_allclose(info["reward_near"][flies], near[flies], atol=1e-6)
        np.testing.assert_allclose(info["reward_turning"][flies], turning[flies], rtol=1e-5, atol=1e-7)
        lost += int(terminated.sum())
        if lost == 0:
            _, one, *_, alone = single.step(actions[0])
            assert one == reward[0] and alone == {part: float(info[part][0]) for part in parts}
    assert lost > 0

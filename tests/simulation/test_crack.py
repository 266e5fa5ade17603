import numpy as np
import pytest

from tasks.simulation.crack import SAMPLE_M, SMOOTH_M, STEP_M, CrackShape, branch, crack


def grown(seed: int, width_m: float = 0.004) -> CrackShape:
    return crack(np.random.default_rng(seed), "C", (0.1, 0.2), 30.0, 0.8, width_m)


@pytest.mark.parametrize("seed", range(8))
def test_it_has_the_length_and_heading_asked_for(seed: int) -> None:
    one = grown(seed)
    assert one.length_m == pytest.approx(0.8, abs=2 * STEP_M)
    along = one.uv_m[-1] - one.uv_m[0]
    assert np.degrees(np.arctan2(along[1], along[0])) == pytest.approx(30.0, abs=8.0)


@pytest.mark.parametrize("seed", range(8))
def test_it_tapers_to_nothing_and_is_as_wide_as_asked_between(seed: int) -> None:
    one = grown(seed)
    width = one.left_m + one.right_m
    assert width[[0, -1]] == pytest.approx([0.0, 0.0], abs=1e-4)
    middle = width[len(width) // 4 : -len(width) // 4]
    assert np.median(middle) == pytest.approx(0.004, rel=0.25)
    assert (one.left_m >= 0).all() and (one.right_m >= 0).all()


def test_its_length_does_not_depend_on_how_closely_one_looks() -> None:
    one = grown(3)
    coarse = one.uv_m[:: round(2 * SMOOTH_M / STEP_M)]
    looked_at = np.linalg.norm(np.diff(coarse, axis=0), axis=1).sum()
    walked = np.linalg.norm(np.diff(one.uv_m[: len(coarse) * 10 - 9], axis=0), axis=1).sum()
    assert looked_at == pytest.approx(walked, rel=0.01)


@pytest.mark.parametrize("chord_mm", [8, 16, 32, 64])
def test_it_turns_as_real_cracks_do_at_every_scale(chord_mm: int) -> None:
    """About as much at every length: paths are self-affine (part turns of the benchmark of detection)."""
    turns = []
    for seed in range(30):
        chords = np.diff(grown(seed).uv_m[::chord_mm], axis=0)
        heading = np.unwrap(np.arctan2(chords[:, 1], chords[:, 0]))
        turns.append(np.degrees(np.diff(heading)))
    assert 12.0 < np.sqrt(np.mean(np.concatenate(turns) ** 2)) < 20.0


def test_its_width_is_correlated_along_its_length() -> None:
    middle = slice(200, 600)
    lags = {10: [], 200: []}  # steps of 1 mm
    for seed in range(12):
        one = grown(seed)
        log = np.log((one.left_m + one.right_m)[middle])
        for lag, values in lags.items():
            values.append(float(np.corrcoef(log[:-lag], log[lag:])[0, 1]))
    assert np.mean(lags[10]) > 0.6
    assert np.mean(lags[200]) < 0.3


def test_the_sampled_widths_are_means_of_the_edges() -> None:
    one = grown(4)
    uv, width = one.sampled()
    assert np.linalg.norm(np.diff(uv, axis=0), axis=1)[:-1].max() <= SAMPLE_M * 1.001
    exact = one.left_m + one.right_m
    assert width[40] == pytest.approx(exact[119:122].mean(), rel=1e-9)
    assert width.mean() == pytest.approx(exact.mean(), rel=0.01)


def test_a_wide_crack_is_clearly_dark_and_a_thin_one_less() -> None:
    assert grown(1, 0.004).kept_light.mean() < 0.3
    assert grown(1, 0.0008).kept_light.mean() > grown(1, 0.004).kept_light.mean() + 0.1


def test_a_branch_starts_on_its_trunk() -> None:
    trunk = grown(2)
    twig = branch(np.random.default_rng(0), trunk, 0.5, 0.2, 0.5)
    assert twig.parent == trunk.id
    assert np.linalg.norm(trunk.uv_m - twig.uv_m[0], axis=1).min() < 1e-9
    assert (twig.left_m + twig.right_m)[:50].mean() < 0.75 * np.median(trunk.left_m + trunk.right_m)

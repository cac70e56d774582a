"""A life that was killed goes on from its last checkpoint, bit for bit."""

import numpy as np
import pytest

from wearlab.life.checkpoint import checkpoints
from wearlab.life.euler import Euler
from wearlab.life.integrate import integrate
from wearlab.life.limits import Limits, Snapshots


class Killed(Exception):
    pass


class Rate:
    """Stiff relaxation with a jump, and a memory and an account of its own."""

    def __init__(self):
        self.last, self.work = 0.0, 0.0

    def __call__(self, h):
        self.work += 1.0
        self.last = 0.9 * self.last + 1e-12 * float(h.sum())
        level = (
            1e-9
            * (1.0 + np.linspace(0.0, 1.0, h.size) ** 2)
            * (1.3 if h.max() > 4e-6 else 1.0)
        )
        return np.maximum(0.0, level - 2e-4 * (h - h.mean()) + self.last * 1e-9)

    def remember(self):
        return self.last

    def recall(self, memory):
        self.last = memory

    def accounted(self):
        return self.work

    def account_for(self, done):
        self.work = done


class Wavers(Rate):
    """What is added to the rate at rest wavers with the memory, so
    that steps hold it.
    """

    noise = 2e-10

    def still(self, h):
        return np.maximum(0.0, 1e-9 - 2e-4 * (h - h.mean()))

    def __call__(self, h):
        self.work += 1.0
        self.last = 3.9 * (self.last or 0.3) * (1.0 - (self.last or 0.3))
        return np.maximum(
            0.0, self.still(h) + self.noise * np.cos(np.arange(h.size) * self.last)
        )


class OwnEuler(Euler):
    """A method of no module of wearlab, as a plug-in's is."""


def lived(image=None, die_after=None, of=Rate, method=None):
    images = []
    told = []

    def tell(state, image_of):
        told.append(state)
        images.append(image_of())
        if die_after is not None and len(images) == die_after:
            raise Killed

    rate = of()
    shown = []
    try:
        with checkpoints(tell, image):
            life = integrate(
                rate,
                np.zeros(9),
                limits=Limits(depth=1e-5),
                method=method,
                snapshots=Snapshots(cycles=(1e3, 5e3)),
                progress=lambda node: shown.append((node.cycle, rate.last)),
            )
    except Killed:
        life = None
    return life, images, told, rate, shown


def same(one, other):
    for name in ("cycle", "depth", "rate", "accumulated_error", "snapshot_depth"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
    np.testing.assert_array_equal(
        [step.error for step in one.steps], [step.error for step in other.steps]
    )
    assert one.end_reason == other.end_reason
    assert (one.count_rate_evaluations, one.count_rejected) == (
        other.count_rate_evaluations,
        other.count_rejected,
    )
    assert len(one.jumps) == len(other.jumps)


@pytest.mark.parametrize("after", [1, 4, 9])
def test_a_killed_life_goes_on_bit_for_bit(after):
    whole, images, told, rate, shown = lived()
    assert len(images) > 9 and len(whole.jumps) == 1
    part, kept, *_ = lived(die_after=after)
    assert part is None and len(kept) == after
    again, _, told_again, rate_again, shown_again = lived(kept[-1])
    same(again, whole)
    assert rate_again.work == rate.work
    assert shown_again == shown
    assert told_again == told[after:]


@pytest.mark.parametrize("after", [1, 7])
def test_a_killed_life_whose_steps_are_held_goes_on_bit_for_bit(after):
    whole, *_ = lived(of=Wavers)
    assert whole.count_steps > 20 and all(step.by is None for step in whole.steps)
    _, kept, *_ = lived(die_after=after, of=Wavers)
    same(lived(kept[-1], of=Wavers)[0], whole)


@pytest.mark.parametrize("after", [1, 7])
def test_a_killed_life_with_a_step_of_ones_own_goes_on_bit_for_bit(after):
    whole, *_ = lived(method=OwnEuler(5e-7))
    _, kept, *_ = lived(die_after=after, method=OwnEuler(5e-7))
    again, more, *_ = lived(kept[-1], method=OwnEuler(5e-7))
    same(again, whole)
    assert len(more) == whole.count_steps - after
    other, *_ = lived(kept[-1], method=OwnEuler(1e-6))
    assert other.count_steps < whole.count_steps


def test_what_ended_is_not_marched_again():
    whole, images, *_ = lived()
    again, more, *_ = lived(images[-1])
    same(again, whole)
    assert not more


def test_another_march_takes_nothing_up():
    _, images, *_ = lived()
    with checkpoints(lambda told, image: None, images[-1]):
        other = integrate(Rate(), np.full(9, 1e-7), limits=Limits(depth=1e-5))
    assert other.cycle[0] == 0.0 and other.depth[0].max() == 1e-7


def test_lives_without_a_keeper_are_the_same():
    whole, *_ = lived()
    same(
        integrate(
            Rate(),
            np.zeros(9),
            limits=Limits(depth=1e-5),
            snapshots=Snapshots(cycles=(1e3, 5e3)),
        ),
        whole,
    )

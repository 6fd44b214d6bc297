# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The scheduler finds what depends on the order of threads, and reproduces it by its number."""

import pytest

from mlmem_ros import threads

from .primitives import scheduled
from .scheduler import Deadlock, Endless, Scheduler


def world(seed, main, **options):
    """Run a function as a task, and return the scheduler."""
    scheduler = Scheduler(seed, **options)
    with scheduled(scheduler):
        scheduler.run(scheduler.spawn(main, 'main'))
    return scheduler


def worlds(seeds, main):
    for seed in seeds:
        world(seed, main)


def start(*functions):
    """Start threads, and return them."""
    started = [threads.Thread(target=function, name=function.__name__) for function in functions]
    for thread in started:
        thread.start()
    return started


def count_to_two(locked):
    """Return the result of two threads that each add one, with or without a lock."""
    total = [0]

    def main():
        lock = threads.Lock()

        def add():
            if locked:
                lock.acquire()
            seen = total[0]
            threads.monotonic()  # a hand-over between the look and the write
            total[0] = seen + 1
            if locked:
                lock.release()

        for thread in start(add, add):
            thread.join()

    return main, total


def test_a_lost_update_is_found_within_a_few_seeds():
    def lost(seed):
        main, total = count_to_two(locked=False)
        world(seed, main)
        return total[0] < 2

    assert 3 <= sum(map(lost, range(50))) < 50


def test_a_lock_prevents_it_in_every_order():
    for seed in range(50):
        main, total = count_to_two(locked=True)
        world(seed, main)
        assert total[0] == 2


def test_the_same_seed_gives_the_same_history():
    def history(seed):
        return list(world(seed, count_to_two(locked=True)[0]).history)

    assert history(7) == history(7)
    assert len({str(history(seed)) for seed in range(20)}) > 10


def test_a_deadlock_says_who_waits_for_what():
    def main():
        first, second = threads.Lock(), threads.Lock()

        def up():
            with first, second:
                pass

        def down():
            with second, first:
                pass

        for thread in start(up, down):
            thread.join()

    with pytest.raises(Deadlock, match=r'up waits for lock .* held by down; down waits for lock'):
        worlds(range(50), main)


def test_a_wake_up_that_nobody_waits_for_yet_is_lost():
    def main():
        changed = threads.Condition()

        def sleeper():
            with changed:
                changed.wait()

        def waker():
            with changed:
                changed.notify_all()

        for thread in start(sleeper, waker):
            thread.join()

    with pytest.raises(Deadlock, match='sleeper waits for condition'):
        worlds(range(50), main)


def test_time_passes_only_when_nobody_can_run():
    times = []

    def main():
        def sleeps(seconds):
            changed = threads.Condition()
            with changed:
                assert not changed.wait(seconds)
            times.append(threads.monotonic())

        def long():
            sleeps(3600.0)

        def short():
            sleeps(0.5)

        began = threads.monotonic()
        for thread in start(long, short):
            thread.join()
        times[:] = [time - began for time in times]

    world(3, main)
    assert times == pytest.approx([0.5, 3600.0], abs=1e-4)


def test_who_is_notified_as_its_time_runs_out_is_told_once():
    def main():
        changed = threads.Condition()

        def waits():
            with changed:
                changed.wait(1e-6)

        def notifies():
            for _ in range(3):
                threads.monotonic()
                with changed:
                    changed.notify_all()

        for thread in start(waits, waits, notifies):
            thread.join()

    for seed in range(100):
        assert world(seed, main).leftovers() == []


def test_a_future_is_waited_for_and_cancelled_as_the_library_does():
    seen = []

    def main():
        asked, given_up = threads.Future(), threads.Future()
        asked.add_done_callback(lambda done: seen.append(('called back', done.result())))

        def answers():
            assert asked.set_running_or_notify_cancel()
            asked.set_result(7)
            assert not given_up.set_running_or_notify_cancel()

        given_up.cancel()
        start(answers)
        seen.append(('waited', asked.result()))

    world(1, main)
    assert sorted(seen) == [('called back', 7), ('waited', 7)]


def test_what_a_thread_or_a_callback_raises_is_told():
    def main():
        def fails():
            raise ValueError('in a thread')

        answer = threads.Future()
        answer.add_done_callback(lambda _: 1 / 0)
        (thread,) = start(fails)
        answer.set_result(None)
        thread.join()

    failures = world(1, main).failures
    assert {type(failure) for _, failure in failures} == {ValueError, ZeroDivisionError}


def test_what_is_left_over_is_named():
    def main():
        lock = threads.Lock()
        lock.acquire()
        threads.Future()
        changed = threads.Condition()

        def waits():
            with changed:
                changed.wait()

        start(waits)
        threads.Condition().acquire()

    scheduler = world(1, main)
    scheduler.settle(1.0)
    left = ' '.join(scheduler.leftovers())
    assert all(text in left for text in ('thread waits', 'held by main', 'pending'))


def test_a_process_can_be_killed_at_any_hand_over():
    done = []

    def main():
        changed = threads.Condition()

        def works():
            for number in range(10):
                with changed:
                    changed.wait(1.0)
                done.append(number)

        for thread in start(works, works):
            thread.join()
        done.append('end')

    for crash_at in range(1, 60):
        done.clear()
        scheduler = Scheduler(crash_at, restless=0.4)
        with scheduled(scheduler):
            scheduler.spawn(main, 'main')
            scheduler.crash_at = crash_at
            scheduler.settle(3600.0)
        assert scheduler.crashed
        assert 'end' not in done
        assert not scheduler.leftovers()
        assert not scheduler.failures


def test_a_world_without_end_is_noticed():
    def main():
        while True:
            threads.monotonic()

    with pytest.raises(Endless):
        world(1, main, most=1000)

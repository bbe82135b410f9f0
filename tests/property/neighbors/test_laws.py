"""A neighbour law is its function called for each pair, whatever the crowd; Every compares them in each step, bit for bit."""

from hypothesis import given, settings
from hypothesis import strategies as st
from law_plugins import Every, play


@settings(max_examples=25)
@given(
    n=st.integers(1, 90),
    seeds=st.lists(st.integers(0, 2**40), min_size=1, max_size=4, unique=True),
    spread=st.sampled_from([0.0, 1.0, 30.0, 1e3, 1e7]),
    gain=st.floats(-4.0, 4.0),
    threads=st.integers(1, 3),
)
def test_a_law_is_brute_force_over_any_stack(n, seeds, spread, gain, threads):
    play(Every(gain=gain), steps=2, n=n, seeds=seeds, spread=spread, threads=threads)

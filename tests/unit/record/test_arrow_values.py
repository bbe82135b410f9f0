"""Arrow arrays as PyArrow makes them, without pandas."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pyarrow as pa
import pytest

from tussle.record.arrow_values import arrow_array


@pytest.mark.parametrize(
    ("values", "kind"),
    [
        ([1.5, None, float("nan"), -0.0], pa.float64()),
        ([True, None, False] * 5, pa.bool_()),
        (["", None, "zwölf", "a\x00b"], pa.string()),
        ((3, -4, None), pa.int32()),
        (["a"], pa.string()),
        ([], pa.string()),
        ([], pa.float32()),
        (np.arange(20, dtype=np.int32)[::3], pa.int64()),
        (np.arange(9.0), None),
        (np.arange(9) % 2 == 0, None),
        (np.arange(12).reshape(3, 4)[:, 1], None),
    ],
)
def test_arrays_equal_those_of_pyarrow(values, kind):
    found, expected = arrow_array(values, kind), pa.array(values, kind)
    found.validate(full=True)
    assert found.type == expected.type
    assert found.to_pylist().__repr__() == expected.to_pylist().__repr__()


def test_masked_values_are_null():
    values, mask = np.arange(11.0), np.arange(11) % 3 == 1
    assert arrow_array(values, mask=mask).equals(pa.array(values, mask=mask))


def test_numbers_that_do_not_fit_are_refused():
    for values in ([2**31], np.array([2**31])):
        with pytest.raises(OverflowError):
            arrow_array(values, pa.int32())


def test_a_recorded_run_does_not_import_pandas(tmp_path):
    """Once its kernels are in the cache: those that came with the wheel, or that the first of two runs has compiled."""
    program = (
        "import sys\nfrom tussle.cli import main\n"
        f"sys.argv = ['tussle', 'run', 'predator_prey', '--set', 'end=1', '--out', {str(tmp_path / 'run')!r} + sys.argv[1]]\n"
        "try:\n    main()\nexcept SystemExit as end:\n    assert not end.code\n"
        "print([each for each in ('pandas', 'numba.np.arraymath') if each in sys.modules])"
    )
    for suffix in ("", "-again"):
        command = [sys.executable, "-c", program, suffix]
        done = subprocess.run(command, check=True, capture_output=True, text=True)
        if (imported := done.stdout.splitlines()[-1]) == "[]":
            break
    assert imported == "[]"
    assert (tmp_path / "run" / "run.json").is_file()

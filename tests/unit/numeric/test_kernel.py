"""Kernels: signatures and messages, what a key sees, what is kept on disk and when it is used."""

from __future__ import annotations

import gc
import hashlib
import os
import pickle
import re
import subprocess
import sys
import warnings
from concurrent.futures import ThreadPoolExecutor
from itertools import product
from pathlib import Path

import numpy as np
import pytest

from tussle.numeric import operator_types, processor, store
from tussle.numeric.fingerprint import Fingerprint
from tussle.numeric.kernel import built, device, kernel, lean_routine, stats

GAIN = 2.0


@device
def scaled(x):
    return GAIN * x


@kernel("F f8 Fw")
def scale_rows(x, offset, out):
    for i in range(x.shape[0]):
        out[i] = scaled(x[i]) + offset


@kernel("F2 I B U i8 b1 u8 -> f8 i8")
def all_codes(table, integers, flags, words, n, flag, word):
    total = table[1, 0] + integers[0] + n
    return total + (1.0 if flags[0] and flag else 0.0), np.int64(words[0] + word)


@pytest.fixture
def own_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("TUSSLE_CACHE_DIR", str(tmp_path / "cache"))
    return tmp_path / "cache"


@pytest.fixture
def forget_kernels():
    """Forgets the kernels of this process, as if it had just begun."""
    built.cache_clear()
    return built.cache_clear


def test_kernel_computes_in_place():
    out = np.empty(3)
    scale_rows(np.array([1.0, 2.0, 3.0]), 10, out)
    np.testing.assert_array_equal(out, [12.0, 14.0, 16.0])


def test_results_follow_the_arrow():
    arguments = (
        np.array([[0.0], [2.0]]),
        np.array([3]),
        np.array([True]),
        np.array([5], np.uint64),
        4,
        True,
        6,
    )
    assert all_codes(*arguments) == (10.0, 11)


def test_read_only_array_is_taken_where_the_code_reads():
    x = np.ones(2)
    x.flags.writeable = False
    out = np.empty(2)
    scale_rows(x, 0.0, out)
    assert (out == 2.0).all()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((np.ones(2), 0.0, 3), "argument 'out' must be a writable 1-D contiguous float64 array, not int 3"),
        (
            (np.ones(2, int), 0.0, np.ones(2)),
            "'x' must be a 1-D contiguous float64 array, not a int64 array of shape",
        ),
        (
            (np.ones(4)[::2], 0.0, np.ones(2)),
            "'x' must be a 1-D contiguous float64 array, not a non-contiguous float64 array",
        ),
        ((np.ones((1, 2)), 0.0, np.ones(2)), r"'x' must be .*, not a float64 array of shape \(1, 2\)"),
        ((np.ones(2), "a", np.ones(2)), "'offset' must be a number, not str 'a'"),
        ((np.ones(2), 0.0, np.broadcast_to(1.0, 2)), "'out' must be a writable .*, not a read-only"),
    ],
)
def test_wrong_argument_is_named_with_what_is_expected(arguments, message):
    with pytest.raises(TypeError, match=f"kernel .*test_kernel.scale_rows: .*{message}"):
        scale_rows(*arguments)


def test_fraction_is_not_cut_to_an_integer():
    arguments = (np.ones((2, 1)), np.ones(1, int), np.array([True]), np.ones(1, np.uint64), 2.5, True, 6)
    with pytest.raises(TypeError, match=r"'n' must be an integer, not float 2\.5"):
        all_codes(*arguments)


def test_wrong_number_of_arguments():
    with pytest.raises(TypeError, match="expected 3, got 1"):
        scale_rows(np.ones(2))


@pytest.mark.parametrize(
    ("signature", "message"),
    [("F Q Fw", "unknown code"), ("F Fw", "has 3 arguments"), ("F f8 Fw ->", "code")],
)
def test_unsound_signature_is_refused_where_it_stands(signature, message):
    with pytest.raises(ValueError, match=f"scale_rows.*{message}"):
        kernel(signature)(scale_rows.py_func)


def test_kernel_calls_kernel():
    @kernel("F Fw")
    def twice(x, out):
        scale_rows(x, 1.0, out)
        scale_rows(out, 1.0, out)

    out = np.empty(2)
    twice(np.ones(2), out)
    assert (out == 7.0).all()


def test_kernel_is_pickled_by_name():
    assert pickle.loads(pickle.dumps(scale_rows)) is scale_rows


def test_second_call_neither_compiles_nor_loads():
    scale_rows(np.ones(2), 0.0, np.empty(2))
    before = (stats.compiled, stats.loaded)
    scale_rows(np.ones(5), 1, np.empty(5))
    assert (stats.compiled, stats.loaded) == before


def test_threads_that_call_first_compile_once(own_cache):
    @kernel("F Fw")
    def fresh(x, out):
        out[0] = x[0] + 41.0

    def call(_):
        out = np.empty(1)
        fresh(np.ones(1), out)
        return out[0]

    before = stats.compiled
    with ThreadPoolExecutor(4) as pool:
        assert set(pool.map(call, range(8))) == {42.0}
    assert stats.compiled == before + 1


def test_functions_that_a_kernel_calls_may_print_raise_and_call_themselves(own_cache, forget_kernels, capsys):
    """Compiled, and loaded from a file."""

    @device
    def told(x):
        if x < 0.0:
            raise ValueError("a negative number")
        if x > 5.0:
            print("large", x)
        return 2.0 * x

    @lean_routine
    def doubled(x, times):
        return told(x) if times == 1 else doubled(told(x), times - 1)

    for compiled in (1, 0):
        before = stats.compiled
        play = kernel("f8 i8 -> f8")(lambda x, times: doubled(x, times) + 0.0)
        assert (play(3.0, 1), capsys.readouterr().out) == (6.0, "")
        assert (play(3.0, 2), capsys.readouterr().out) == (12.0, "large 6.0\n")
        with pytest.raises(ValueError, match="a negative number"):
            play(-1.0, 3)
        assert stats.compiled - before == compiled
        forget_kernels()


def test_who_waits_is_told_before_a_kernel_compiles(own_cache, monkeypatch):
    told = []
    monkeypatch.setattr(stats, "on_compile", lambda name: told.append((name, stats.compiled)))

    @kernel("F Fw")
    def announced(x, out):
        out[0] = x[0] + 43.0

    before = stats.compiled
    for _ in range(2):
        announced(np.ones(1), np.empty(1))
    assert told == [(announced.name, before)]
    assert stats.compiled == before + 1


@pytest.mark.usefixtures("own_cache")
def test_a_device_gets_an_entry_for_python_when_python_calls_it():
    @kernel("f8 -> f8")
    def calling(x):
        return scaled(x) + 45.0

    calling(1.0)
    (inside,) = scaled.dispatcher.overloads.values()
    assert not re.findall("cpython|cfunc", inside.library.get_llvm_str())
    assert scaled(3.0) == 6.0


def test_operators_on_numbers_have_the_types_that_numba_gives_them():
    from numba import types
    from numba.core.errors import NumbaError
    from numba.core.registry import cpu_target

    operator_types.type_numbers()
    context = cpu_target.typing_context
    context.refresh()
    kinds = [types.int64, types.float64, types.boolean, types.uint64, types.int32, types.float32]
    kinds += [types.literal(3), types.literal(True)]

    def found(function, arguments):
        try:
            signature = function.get_call_type(context, arguments, {})
        except NumbaError:
            return None
        return signature.return_type, signature.args

    for each in operator_types.OPERATORS:
        with_rule = context.resolve_value_type(each)
        others = [t for t in with_rule.templates if t is not operator_types.rule(each)]
        assert len(others) < len(with_rule.templates)
        for arguments in product(kinds, repeat=1 if each is bool else 2):
            of_numba = found(type(with_rule)(others), arguments)
            assert found(with_rule, arguments) == of_numba, (each, arguments)


@device
def item(things, place):
    return things[place]


def test_a_device_is_compiled_once_for_all_constants_unless_it_needs_them(own_cache, forget_kernels):
    @device
    def doubled(k):
        return k + k

    @kernel("F I i8 -> f8 i8")
    def run(x, n, k):
        things = x, n
        return item(things, 0)[1], item(things, 1)[0] + doubled(3) + doubled(True) + doubled(k)

    assert run(np.arange(2.0), np.array([7]), 20) == (1.0, 7 + 6 + 2 + 40)
    assert len(doubled.dispatcher.overloads) == 2  # of integers and of truths
    assert len(item.dispatcher.overloads) == 2


def test_garbage_is_not_looked_for_while_a_kernel_compiles():
    class Watched:
        @property
        def _numba_type_(self):
            collecting.append(gc.isenabled())
            return scaled._numba_type_

    watched, collecting = Watched(), []

    @kernel("f8 -> f8")
    def watching(x):
        return watched(x)

    assert watching(3.0) == 6.0
    assert set(collecting) == {False}
    assert gc.isenabled()


# What the key sees -----------------------------------------------------------------------------------------


def key_of(source: str, name: str = "f", **scope: object) -> str:
    exec(compile(source, "<test>", "exec"), scope)
    return Fingerprint(scope[name]).digest


BASE = "K = 3.0\ndef g(x):\n    return x * K\ndef f(x):\n    return g(x) + 1.0\n"


def test_lines_comments_and_wording_of_docstrings_change_no_key():
    assert key_of("# a comment\n\n" + BASE) == key_of(BASE)
    assert key_of(BASE.replace("def f(x):", "def f(x):\n    # why\n")) == key_of(BASE)
    documented = [BASE.replace("def g(x):", f'def g(x):\n    "{text}"') for text in ("Doc.", "Another.")]
    assert key_of(documented[0]) == key_of(documented[1])


def test_every_change_that_counts_changes_the_key():
    sources = [
        BASE,
        BASE.replace("3.0", "3.5"),
        BASE.replace("K = 3.0", "K = 3"),
        BASE.replace("x * K", "x / K"),
        BASE.replace("+ 1.0", "+ 2.0"),
        BASE.replace("return g(x)", "return [g(y) for y in (x, 2.0)][1]"),
        BASE.replace("return g(x)", "return [g(y) for y in (x, 3.0)][1]"),
        BASE.replace("def g(x)", "def g(x, y=1.0)"),
        BASE.replace("def g(x)", "def g(x, y=2.0)"),
        BASE.replace("def g(x)", "def g(x, *, y=2.0)"),
    ]
    assert len({key_of(source) for source in sources}) == len(sources)


def test_frozen_arrays_tuples_and_closures_count():
    source = "def f(i):\n    return K[i]\n"
    arrays = [
        np.arange(3.0),
        np.arange(3),
        np.array([0.0, 1.0, 2.5]),
        (0.0, 1.0),
        (0.0, 1),
        (0.0, (1.0,)),
        np.float64(1.0),
    ]
    keys = [key_of(source, K=value) for value in arrays]
    assert len(set(keys)) == len(keys)
    closing = "def make(k):\n    def f(x):\n        return x + k\n    return f\nf = make(%s)\n"
    assert key_of(closing % 1.0) != key_of(closing % 2.0)


def test_module_attributes_count_for_each_function_that_reads_them():
    import types

    library = types.ModuleType("library")
    library.a, library.b = 1.0, 1.0
    source = "def g(x):\n    return x * m.a\ndef f(x):\n    return g(x) + m.b\n"
    first = key_of(source, m=library)
    library.b = 2.0
    second = key_of(source, m=library)
    library.a = 2.0
    assert len({first, second, key_of(source, m=library)}) == 3


def test_recursion_and_cycles_end():
    assert key_of("def g(x):\n    return f(x)\ndef f(x):\n    return g(x)\n")


def test_jitted_meaning_of_an_overloaded_function_counts():
    from numba.extending import overload

    def plain(x):
        return x

    def user(x):
        return plain(x)

    before = Fingerprint(user).digest

    @overload(plain)
    def meaning(x):
        return lambda x: x + 1.0

    assert Fingerprint(user).digest != before


def test_object_that_cannot_be_described_is_reported():
    class Strange:
        pass

    strange = Strange()

    def f(x):
        return x if strange else 0.0

    assert Fingerprint(f).opaque
    assert not Fingerprint(scaled.py_func).opaque


def test_global_redefined_at_the_prompt_is_seen_by_new_kernels(own_cache):
    scope: dict = {"device": device, "kernel": kernel, "K": 1.0}
    exec("@device\ndef g(x):\n    return x + K\n", scope)
    define = "@kernel('f8 -> f8')\ndef f(x):\n    return g(x)\n"
    exec(define, scope)
    assert scope["f"](1.0) == 2.0
    scope["K"] = 10.0
    exec(define, scope)
    assert scope["f"](1.0) == 11.0


# Files -----------------------------------------------------------------------------------------------------


def test_damaged_file_is_compiled_anew(own_cache, forget_kernels):
    kernel("F f8 Fw")(scale_rows.py_func)(np.ones(1), 0.0, np.empty(1))
    (path,) = own_cache.glob("*.kernel")
    content = path.read_bytes()
    path.write_bytes(content[:-9])
    before = stats.compiled
    forget_kernels()
    kernel("F f8 Fw")(scale_rows.py_func)(np.ones(1), 0.0, np.empty(1))
    assert stats.compiled == before + 1
    # A sound file is there again: the next one is loaded. (Its size is no measure: pickles of the same thing differ by a few bytes.)
    loaded = stats.loaded
    forget_kernels()
    kernel("F f8 Fw")(scale_rows.py_func)(np.ones(1), 0.0, np.empty(1))
    assert (stats.compiled, stats.loaded) == (before + 1, loaded + 1)


def test_a_kernel_that_came_with_the_package_is_loaded_unless_it_is_damaged(
    own_cache, tmp_path, monkeypatch, forget_kernels
):
    def play():
        forget_kernels()
        before = stats.compiled, stats.loaded
        out = np.empty(1)
        kernel("F f8 Fw")(scale_rows.py_func)(np.ones(1), 1.0, out)
        assert out == [3.0]
        return stats.compiled - before[0], stats.loaded - before[1]

    assert play() == (1, 0)
    own_cache.rename(tmp_path / "shipped")
    monkeypatch.setattr(store, "SHIPPED", tmp_path / "shipped")
    assert play() == (0, 1)
    assert not list(own_cache.glob("*.kernel"))
    (path,) = (tmp_path / "shipped").glob("*.kernel")
    path.write_bytes(path.read_bytes()[:-9])
    assert play() == (1, 0)


@pytest.mark.parametrize(
    ("settings", "begin", "name"),
    [
        ({}, "", processor.level()),
        ({"NUMBA_CPU_NAME": "generic"}, "", "generic"),
        ({}, "import numba; numba.njit(lambda x: x)(1.0)", None),
    ],
    ids=["nothing chosen", "chosen by the user", "Numba has compiled before"],
)
def test_kernels_are_compiled_for_the_level_of_the_processor_unless_something_else_is_settled(
    settings, begin, name
):
    code = f"{begin}\nfrom tussle.numeric import processor; print(processor.target()[1])"
    env = os.environ | settings
    done = subprocess.run([sys.executable, "-c", code], env=env, capture_output=True, text=True, check=True)
    found = done.stdout.strip()
    assert found == name if name else found not in processor.LEVELS  # else the name of this very processor


def test_directory_that_cannot_be_written_warns_once_and_works(tmp_path, monkeypatch, forget_kernels):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("TUSSLE_CACHE_DIR", str(tmp_path / "file" / "cache"))
    out = np.empty(1)
    with pytest.warns(RuntimeWarning, match=r"cannot be stored in .*file/cache.*TUSSLE_CACHE_DIR"):
        kernel("F f8 Fw")(scale_rows.py_func)(np.ones(1), 1.0, out)
    assert out[0] == 3.0
    forget_kernels()
    kernel("F f8 Fw")(scale_rows.py_func)(np.ones(1), 2.0, out)  # a second warning would be an error
    assert out[0] == 4.0


def test_kernels_of_the_same_content_share_their_machine_code(own_cache, forget_kernels):
    first, second = kernel("F f8 Fw")(scale_rows.py_func), kernel("F f8 Fw")(scale_rows.py_func)
    out = np.empty(1)
    first(np.ones(1), 1.0, out)
    before = stats.compiled, stats.loaded
    second(np.ones(1), 2.0, out)
    assert out[0] == 4.0
    assert second.address == first.address
    assert (stats.compiled, stats.loaded) == before


def test_old_files_of_one_name_are_removed_and_others_stay(own_cache):
    for i in range(store.KEEP + 3):
        store.save("module.law", f"{i:032x}", b"data")
        os.utime(own_cache / f"module.law-{i:032x}.kernel", (i, i))
    store.save("module.law_of_another", f"{0:032x}", b"data")
    names = sorted(path.name for path in own_cache.iterdir())
    assert len(names) == store.KEEP + 1
    assert f"module.law-{store.KEEP + 2:032x}.kernel" in names
    assert f"module.law-{0:032x}.kernel" not in names


def test_folder_is_chosen_by_the_environment(monkeypatch, tmp_path):
    monkeypatch.setenv("TUSSLE_CACHE_DIR", str(tmp_path / "a"))
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "b"))
    assert store.directory() == tmp_path / "a"
    monkeypatch.delenv("TUSSLE_CACHE_DIR")
    assert store.directory() == tmp_path / "b" / "tussle"
    monkeypatch.delenv("NUMBA_CACHE_DIR")
    assert "tussle" in str(store.directory())
    assert store.directory().is_absolute()


def dangerous(path):
    """Pickled data that makes a file when it is loaded, as `store.save` writes it."""

    class Evil:
        def __reduce__(self):
            return (Path.touch, (path,))

    data = pickle.dumps(Evil())
    return hashlib.sha256(data).digest() + data


KEY = f"{0:032x}"


def nothing_is_loaded(folder, tmp_path):
    """A file in the folder is not loaded under its name."""
    (folder / f"module.law-{KEY}.kernel").write_bytes(dangerous(tmp_path / "ran"))
    assert store.load("module.law", KEY) is None
    assert not (tmp_path / "ran").exists()


@pytest.fixture
def temporary(tmp_path, monkeypatch):
    """Where temporary folders are made."""
    (tmp_path / "temporary").mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "temporary"))
    store._temporary_folder.cache_clear()
    return tmp_path / "temporary"


@pytest.mark.parametrize("mode", [0o1777, 0o770, 0o702])
def test_a_folder_that_others_may_write_is_not_used(tmp_path, monkeypatch, temporary, mode):
    folder = tmp_path / "shared"
    folder.mkdir()
    folder.chmod(mode)
    monkeypatch.setenv("TUSSLE_CACHE_DIR", str(folder))
    with pytest.warns(RuntimeWarning, match=r"not stored in .*shared: .*TUSSLE_CACHE_DIR"):
        nothing_is_loaded(folder, tmp_path)
    store.save("module.law", KEY, pickle.dumps("sound"))  # a second warning would be an error
    assert store.load("module.law", KEY) == "sound"
    used = store.directory()
    assert used.parent == temporary
    assert used.stat().st_mode & 0o777 == 0o700
    assert store.directory() == used


def test_a_folder_of_somebody_else_is_not_used(tmp_path, monkeypatch, temporary):
    folder = tmp_path / "theirs"
    folder.mkdir(mode=0o700)
    (tmp_path / "link").symlink_to(folder)
    (temporary / f"tussle-{os.geteuid()}").mkdir(mode=0o777)  # taken already
    (temporary / f"tussle-{os.geteuid()}").chmod(0o777)
    is_theirs = os.stat_result((0o40700, *folder.stat()[1:4], os.geteuid() + 1, *folder.stat()[5:]))
    before = Path.stat
    monkeypatch.setattr(
        Path,
        "stat",
        lambda self, **more: is_theirs if os.path.realpath(self) == str(folder) else before(self, **more),
    )
    monkeypatch.setenv("TUSSLE_CACHE_DIR", str(tmp_path / "link"))
    with pytest.warns(RuntimeWarning, match="not stored in"):
        nothing_is_loaded(folder, tmp_path)
    assert store.directory().parent == temporary
    assert store.directory().name != f"tussle-{os.geteuid()}"


def test_a_file_that_somebody_else_may_have_written_is_not_loaded(own_cache, tmp_path, monkeypatch):
    store.save("module.law", KEY, pickle.dumps("sound"))
    (path,) = own_cache.glob("*.kernel")
    assert store.load("module.law", KEY) == "sound"
    path.chmod(0o622)
    nothing_is_loaded(own_cache, tmp_path)
    path.unlink()
    (tmp_path / "elsewhere").write_bytes(dangerous(tmp_path / "ran"))
    path.symlink_to(tmp_path / "elsewhere")
    assert store.load("module.law", KEY) is None
    path.unlink()
    os.mkfifo(path)
    assert store.load("module.law", KEY) is None
    path.unlink()
    path.write_bytes(dangerous(tmp_path / "ran"))
    other = os.geteuid() + 1
    monkeypatch.setattr("os.geteuid", lambda: other)
    monkeypatch.setattr(store, "directory", lambda: own_cache)
    assert store.load("module.law", KEY) is None
    assert not (tmp_path / "ran").exists()


@pytest.mark.parametrize("value", ["", "caches", "../caches"])
def test_an_empty_or_relative_cache_folder_is_ignored(tmp_path, monkeypatch, temporary, value):
    for name in ("TUSSLE_CACHE_DIR", "NUMBA_CACHE_DIR"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", value)
    monkeypatch.setenv("HOME", str(tmp_path))
    assert store.directory() == tmp_path / ".cache" / "tussle" / "kernels"
    monkeypatch.setenv("NUMBA_CACHE_DIR", value)
    if value:
        with pytest.warns(RuntimeWarning, match=f"NUMBA_CACHE_DIR={value} is ignored"):
            store.directory()
    assert store.directory() == tmp_path / ".cache" / "tussle" / "kernels"


@pytest.mark.parametrize("home", ["", "somewhere", None])
def test_without_a_home_kernels_are_kept_in_no_relative_path(monkeypatch, temporary, home):
    for name in ("TUSSLE_CACHE_DIR", "NUMBA_CACHE_DIR", "XDG_CACHE_HOME", "HOME"):
        monkeypatch.delenv(name, raising=False)
    if home is not None:
        monkeypatch.setenv("HOME", home)
    store.warn_once.cache_clear()
    monkeypatch.setitem(sys.modules, "pwd", None)  # a user whom nobody knows
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        assert store.directory().is_absolute()


# Across processes ------------------------------------------------------------------------------------------

FILES = {
    "constants.py": "GRAVITY = 9.0\n",
    "deep.py": "from tussle.numeric.kernel import device\nimport constants\n"
    "@device\ndef deep(x):\n    return x + constants.GRAVITY\n",
    "shallow.py": "from tussle.numeric.kernel import device\nfrom deep import deep\n"
    "@device\ndef shallow(x):\n    return deep(x) * 2.0\n",
    "law.py": (
        "from tussle.numeric.kernel import kernel\nimport shallow\nfrom tussle.numeric import sin\n"
        "@kernel('f8 -> f8')\ndef law(x):\n    return shallow.shallow(x) + 0.0 * sin(x)\n"
        "@kernel('f8 -> f8')\ndef other(x):\n    return x + 0.5\n"
        "def make(k):\n    @kernel('f8 -> f8')\n    def made(x):\n        return x * k\n    return made\n"
        "scope = {'sin': sin}\nexec('def wrapper(x):\\n    return sin(x) * 0.0 + 7.0', scope)\n"
        "generated = kernel('f8 -> f8')(scope['wrapper'])\n"
    ),
}
PROGRAM = (
    "import law, sys\nfrom tussle.numeric.kernel import stats\n"
    "print(law.law(1.0), law.other(1.0), law.make(2.0)(1.0), law.make(3.0)(1.0), "
    "law.generated(1.0), stats.compiled, stats.loaded)"
)


@pytest.fixture
def project(tmp_path):
    """A user's own folder of modules, and a function that runs them in a fresh process."""
    for name, text in FILES.items():
        (tmp_path / name).write_text(text)

    env = os.environ | {
        "PYTHONPATH": f"{tmp_path}:{Path(store.__file__).parents[2]}",
        "PYTHONDONTWRITEBYTECODE": "1",
        "TUSSLE_CACHE_DIR": str(tmp_path / "cache"),
    }

    def start(program: str = PROGRAM) -> subprocess.Popen[str]:
        command = [sys.executable, "-W", "error", "-c", program]
        return subprocess.Popen(command, env=env, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

    def run(program: str = PROGRAM) -> list[float]:
        process = start(program)
        out, err = process.communicate()
        assert process.returncode == 0, err
        return [float(word) for word in out.split()]

    run.start = start  # type: ignore[attr-defined]
    run.edit = lambda name, old, new: (tmp_path / name).write_text(
        (tmp_path / name).read_text().replace(old, new)
    )  # type: ignore[attr-defined]
    return run


@pytest.mark.slow
def test_edits_are_seen_and_only_what_changed_compiles(project):
    assert project() == [20.0, 1.5, 2.0, 3.0, 7.0, 5, 0]
    project.edit("constants.py", "9.0", "99.0")  # an imported constant
    project.edit("deep.py", "@device", "# A comment moves the lines.\n@device")
    assert project() == [200.0, 1.5, 2.0, 3.0, 7.0, 1, 4]
    project.edit("deep.py", "x +", "x -")  # a callee's callee
    project.edit("law.py", "x + 0.5", "x + 0.25")  # the other kernel itself
    assert project() == [-196.0, 1.25, 2.0, 3.0, 7.0, 2, 3]
    project.edit("constants.py", "99.0", "9.0")
    project.edit("deep.py", "x -", "x +")  # as at first: that file is still there
    assert project() == [20.0, 1.25, 2.0, 3.0, 7.0, 0, 5]


@pytest.mark.slow
def test_processes_may_fill_the_cache_at_once(project):
    running = [project.start() for _ in range(3)]
    ended = [process.communicate() for process in running]
    assert [process.returncode for process in running] == [0, 0, 0], ended
    outputs = [out.split() for out, _ in ended]
    assert {tuple(words[:5]) for words in outputs} == {("20.0", "1.5", "2.0", "3.0", "7.0")}
    assert sum(int(words[5]) for words in outputs) == 5  # each kernel is compiled by one of them
    assert project() == [20.0, 1.5, 2.0, 3.0, 7.0, 0, 5]


@pytest.mark.slow
def test_same_names_from_files_of_different_processes_do_not_meet(project):
    # Each process counts its functions from 1, so both files hold symbols made of the same name and number.
    assert project("import law\nprint(law.make(2.0)(1.0))") == [2.0]
    assert project("import law\nprint(law.make(3.0)(1.0))") == [3.0]
    assert project("import law\nprint(law.make(3.0)(1.0), law.make(2.0)(1.0))") == [3.0, 2.0]


@pytest.mark.slow
def test_loaded_kernels_find_what_their_machine_code_calls_and_load_no_compiler(project, tmp_path):
    (tmp_path / "calls.py").write_text(
        "import numpy as np\nfrom tussle.numeric.kernel import kernel\n"
        "@kernel('f8 -> f8')\ndef plain(x):\n    return np.sqrt(x) ** 1.5 + np.floor(x) % 0.75\n"
        "@kernel('F2 F -> f8')\ndef solved(a, b):\n    return np.linalg.solve(a, b)[1]\n"
        "@kernel('f8 -> f8')\ndef drawn(x):\n    np.random.seed(3)\n    return np.random.normal(x, 0.0) + np.median(np.full(3, x))\n"
        "@kernel('f8 -> f8')\ndef named(x):\n    values = {'a': x}\n    return values['a'] + len(str(int(x)))\n"
    )
    program = (
        "import sys\nimport numpy as np\nfrom calls import *\nfrom tussle.numeric.kernel import stats\n"
        "print(plain(16.0), int('numba.np.arraymath' in sys.modules))\n"
        "print(solved(np.array([[2.0, 0.0], [0.0, 4.0]]), np.array([2.0, 3.0])), drawn(5.0), named(12.0), stats.loaded)"
    )
    values = [8.25, 1, 0.75, 10.0, 14.0, 0]
    assert project(program) == values
    assert project(program) == [8.25, 0, *values[2:5], 4]


def test_a_tuple_of_arrays_is_one_argument():
    @kernel("(F I) (Fw Fw) i8 -> f8")
    def shared(own, out, k):
        values, numbers = own
        out[0][k] = values[k] + numbers[k]
        out[1][k] = values[k] * numbers[k]
        return out[0][k]

    own = np.array([1.0, 2.0]), np.array([3, 4])
    out = np.zeros(2), np.zeros(2)
    assert shared(own, out, 1) == 6.0
    assert out[1][1] == 8.0
    own[0].flags.writeable = False
    assert shared(own, out, 0) == 4.0
    with pytest.raises(TypeError, match=r"argument 'own' must be a tuple of 2: .*, not tuple of 1"):
        shared(own[:1], out, 0)
    with pytest.raises(
        TypeError,
        match=r"argument 'out' must be a tuple .*read-only float64 array of shape \(2,\) at place 1",
    ):
        shared(own, (out[0], own[0]), 0)
    with pytest.raises(TypeError, match=r"argument 'own' must be a tuple of 2: .*, not ndarray"):
        shared(own[0], out, 0)


@pytest.mark.slow
def test_without_jit_an_authors_kernels_run_as_python_with_the_same_bits():
    def played(**more):
        script = Path(__file__).with_name("kernels_in_python.py")
        done = subprocess.run(
            [sys.executable, "-W", "error", script],
            env={**os.environ, **more},
            check=True,
            capture_output=True,
            text=True,
        )
        return done.stdout.splitlines()

    compiled, interpreted = played(), played(NUMBA_DISABLE_JIT="1")
    assert "half" not in compiled[0]
    assert interpreted[0] == "ahead derivative drive half law pairs trim"
    assert compiled[1] == interpreted[1]

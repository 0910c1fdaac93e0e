"""The package as a whole: names, hints, documents, threads, signals, processes."""
import inspect
import os
import pathlib
import re
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest
from conftest import data

import strata
from strata import _strata, csg

PUBLIC = [(strata, name) for name in strata.__all__ if name != "csg"] + [(csg, name) for name in csg.__all__]


def members():
    for module, name in PUBLIC:
        thing = getattr(module, name)
        yield f"{module.__name__}.{name}", thing
        if inspect.isclass(thing):
            for attribute, member in vars(thing).items():
                if not attribute.startswith("_"):
                    member = member.__func__ if isinstance(member, classmethod) else member
                    yield f"{module.__name__}.{name}.{attribute}", member


def test_every_public_name_has_a_text_that_explains_it():
    missing = [name for name, thing in members() if callable(thing) or isinstance(thing, property) if not inspect.getdoc(thing)]
    assert not missing


def test_every_public_function_has_type_hints():
    for name, thing in members():
        function = thing.fget if isinstance(thing, property) else thing
        if not inspect.isfunction(function):
            continue
        signature = inspect.signature(function)
        assert signature.return_annotation is not inspect.Signature.empty, name
        for parameter in signature.parameters.values():
            if parameter.name not in ("self", "cls"):
                assert parameter.annotation is not inspect.Parameter.empty, f"{name}: {parameter.name}"


def test_functions_with_parameters_explain_each():
    for name, thing in members():
        if inspect.isfunction(thing) and "Parameters\n" in (thing.__doc__ or ""):
            listed = thing.__doc__.split("Parameters\n")[1]
            for parameter in inspect.signature(thing).parameters:
                if parameter not in ("self", "cls"):
                    assert re.search(rf"\b{parameter}\b", listed), f"{name}: {parameter}"


def test_the_stub_of_the_native_part_names_all_of_it_and_nothing_else():
    stub = pathlib.Path(strata.__file__).with_name("_strata.pyi").read_text()
    named = set(re.findall(r"^(?:def|class) (\w+)|^(\w+):", stub, re.M))
    named = {a or b for a, b in named}
    there = {name for name in vars(_strata) if not name.startswith("__")}
    assert named == there
    assert pathlib.Path(strata.__file__).with_name("py.typed").exists()


def test_long_work_takes_threads():
    for name, thing in members():
        if inspect.isfunction(thing) and {"memory_limit"} & set(inspect.signature(thing).parameters):
            assert "threads" in inspect.signature(thing).parameters, name


def test_python_runs_while_strata_works(knot):
    ticks, ready = [], threading.Event()

    def tick():
        while not ready.is_set():
            ticks.append(time.perf_counter())
            time.sleep(0.001)

    thread = threading.Thread(target=tick)
    thread.start()
    begin = time.perf_counter()
    strata.voxelize(knot, resolution=2000)
    end = time.perf_counter()
    ready.set()
    thread.join()
    assert sum(begin < at < end for at in ticks) > 3


def test_several_threads_may_use_one_mesh(knot):
    expected = strata.voxelize(knot, resolution=100).checksum()
    found = []
    threads = [threading.Thread(target=lambda: found.append(strata.voxelize(knot, resolution=100).checksum())) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert found == [expected] * 8


WORK = """
import os, signal, sys, time, threading
import strata
mesh = strata.read_mesh(sys.argv[1])
part = strata.csg.cube(20, center=True) - strata.csg.sphere(13, fn=1500)
voxels = strata.voxelize(mesh, resolution=900)
work = {work}
sent = []
def interrupt():
    time.sleep(0.3)
    sent.append(time.perf_counter())
    os.kill(os.getpid(), signal.SIGINT)
threading.Thread(target=interrupt, daemon=True).start()
try:
    while True:
        work()
except KeyboardInterrupt:
    print("stopped", time.perf_counter() - sent[0])
strata.voxelize(mesh, resolution=32)
print("and works")
"""


@pytest.mark.parametrize(
    "work",
    [
        "lambda: strata.voxelize(mesh, resolution=12000)",
        "lambda: strata.depth_lists(mesh, resolution=4000)",
        "lambda: voxels.numpy()",
        "lambda: voxels.save(sys.argv[2] + '/big.npy')",
        "lambda: part.measure()",
        "lambda: part.picture(2000, samples=64)",
    ],
)
def test_ctrl_c_stops_the_work_soon(work, tmp_path):
    script = WORK.format(work=work)
    done = subprocess.run([sys.executable, "-c", script, data("knot.obj"), tmp_path], capture_output=True, text=True, timeout=120)
    assert "and works" in done.stdout, done.stderr
    assert float(done.stdout.split()[1]) < 10  # a second; far more where the machine is busy
    assert not any(name.endswith(".npy") and os.path.getsize(tmp_path / name) < 100 for name in os.listdir(tmp_path))


def test_a_process_that_is_forked_works_too(knot):
    expected = strata.voxelize(knot, resolution=64).checksum()
    code = (
        "import multiprocessing, strata, sys\n"
        "mesh = strata.read_mesh(sys.argv[1])\n"
        "def work(n): return strata.voxelize(mesh, resolution=n).checksum()\n"
        "work(64)\n"
        "with multiprocessing.get_context('fork').Pool(2) as pool: print(pool.map(work, [64, 64]))\n"
    )
    done = subprocess.run([sys.executable, "-c", code, data("knot.obj")], capture_output=True, text=True, timeout=120)
    assert done.stdout.strip() == str([expected, expected]), done.stderr


def test_work_without_the_memory_is_an_error(knot):
    with pytest.raises(strata.LimitError, match="take .* bytes, the limit is 1000000"):
        strata.voxelize(knot, resolution=4000, memory_limit=10**6)
    like = strata.voxelize(knot, resolution=500)
    assert strata.voxelize(knot, resolution=500, memory_limit=10**7).checksum() == like.checksum()
    with pytest.raises(strata.UsageError, match="memory_limit must be at least 1 byte"):
        strata.voxelize(knot, resolution=40, memory_limit=0)


def test_every_error_of_the_library_has_a_class():
    codes = {error.code for error in vars(strata).values() if inspect.isclass(error) and issubclass(error, strata.Error)}
    assert codes == {1, 2, 3, 4, 5, 6, 7, 130}


def test_pngs_are_made_of_pictures_alone():
    for bad in (np.zeros((2, 2, 3), np.uint8), np.zeros((2, 2, 4)), np.zeros((0, 2, 4), np.uint8)):
        with pytest.raises(strata.InputError, match="a picture must be"):
            strata.png_of(bad)
    assert strata.png_of(np.zeros((4, 4, 4), np.uint8)[::2, ::2]).startswith(b"\x89PNG")
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler

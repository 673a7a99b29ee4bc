#!/usr/bin/python3
"""When the front door configures anew for libFuzzer: cmake/frontdoor/common.sh, lacks_optional.
Usage: lacks_optional_test.py ROOT"""
import os
import pathlib
import subprocess
import sys
import tempfile

CLANG = "GROUSER_CLANGXX:FILEPATH=/usr/bin/clang++\n"
FUZZES = "GROUSER_CLANG_FUZZES:INTERNAL=ON\n"


def main(root):
    with tempfile.TemporaryDirectory() as folder:
        build, llvm = pathlib.Path(folder, "build"), pathlib.Path(folder, "llvm-14")
        build.mkdir()
        llvm.mkdir()
        library, cache = llvm / "libclang_rt.fuzzer-x86_64.a", build / "CMakeCache.txt"

        def lacks(text, library_after):
            """Of a build with this cache; the library was there before it, came after it, or is not."""
            library.unlink(missing_ok=True)
            cache.write_text(text)
            if library_after is not None:
                library.touch()
                status = library.stat()
                moment = status.st_ctime_ns + (-1 if library_after else 1) * 10**9
                os.utime(cache, ns=(moment, moment))
            call = f'GROUSER_ROOT="{root}"; . "{root}/cmake/frontdoor/common.sh"; lacks_optional "{build}"'
            return subprocess.run(["bash", "-c", call], check=False,
                                  env=os.environ | {"LLVM_ROOT": folder}).returncode == 0

        assert not lacks(CLANG, None)
        assert lacks(CLANG, True)
        assert not lacks(CLANG, False)  # it was tried with it, and failed
        assert not lacks(CLANG + FUZZES, True)
        headers = pathlib.Path("/usr/lib/cmake/pybind11").exists() and any(pathlib.Path("/usr/include").glob("python3*/Python.h"))
        assert lacks("GROUSER_PYTHON_FOUND:INTERNAL=OFF\n", None) == headers
        assert not lacks("GROUSER_PYTHON_FOUND:INTERNAL=ON\n", None)
        mujoco = any(pathlib.Path("/usr/lib").glob("*/libmujoco.so"))
        assert lacks("MUJOCO_LIBRARY:FILEPATH=MUJOCO_LIBRARY-NOTFOUND\n", None) == mujoco
        assert not lacks("MUJOCO_LIBRARY:FILEPATH=/usr/lib/libmujoco.so\n", None)
        genpy = pathlib.Path("/usr/lib/genpy/genmsg_py.py")
        ros = genpy.exists() and pathlib.Path("/usr/share/std_msgs/msg/Header.msg").exists()
        assert lacks("GROUSER_GENPY:FILEPATH=GROUSER_GENPY-NOTFOUND\n", None) == ros
        assert lacks("GROUSER_STD_MSGS:PATH=GROUSER_STD_MSGS-NOTFOUND\n", None) == ros
        assert not lacks(f"GROUSER_GENPY:FILEPATH={genpy}\nGROUSER_STD_MSGS:PATH=/usr/share\n", None)
        assert not lacks("", True)  # of a sanitizer: searches for nothing


if __name__ == "__main__":
    main(sys.argv[1])

#!/usr/bin/env python3
"""Proves that the compiler makes the shipped tables from the published XSDs.

Downloads the wheels that contain the XSDs, compiles them with `schema_tool` and compares the result
with `bundles/schema/tables`, byte by byte. OpenDRIVE 1.8.1 is in no wheel. Give a folder with its
seven XSDs (ASAM's free download, or the repository asam-ev/qc-opendrive) with --opendrive-1-8-1.
Without it, this table is reported as not compared.

    tables_agree.py --tool TARGET/release/deps/schema_tool-HASH [--opendrive-1-8-1 DIR] [--keep DIR] [--write]
"""

import argparse
import pathlib
import shutil
import subprocess
import sys
import tempfile
import zipfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
TABLES = ROOT / "bundles/schema/tables"
WHEELS = ["asam-qc-opendrive==1.0.0", "asam-qc-openscenarioxml==1.0.0"]
SOURCES = {
    "xodr-1.1": ("OpenDRIVE 1.1", "qc_opendrive/schema/1.1"),
    "xodr-1.2": ("OpenDRIVE 1.2", "qc_opendrive/schema/1.2"),
    "xodr-1.3": ("OpenDRIVE 1.3", "qc_opendrive/schema/1.3"),
    "xodr-1.4": ("OpenDRIVE 1.4", "qc_opendrive/schema/1.4"),
    "xodr-1.5": ("OpenDRIVE 1.5", "qc_opendrive/schema/1.5"),
    "xodr-1.6": ("OpenDRIVE 1.6", "qc_opendrive/schema/1.6.1"),
    "xodr-1.7": ("OpenDRIVE 1.7", "qc_opendrive/schema/1.7.0"),
    "xosc-1.0": ("OpenSCENARIO 1.0", "qc_openscenario/schema/1.0.0"),
    "xosc-1.1": ("OpenSCENARIO 1.1", "qc_openscenario/schema/1.1.1"),
    "xosc-1.2": ("OpenSCENARIO 1.2", "qc_openscenario/schema/1.2.0"),
    "xosc-1.3": ("OpenSCENARIO 1.3", "qc_openscenario/schema/1.3.0"),
}


def main():
    arguments = argparse.ArgumentParser()
    arguments.add_argument("--tool", required=True)
    arguments.add_argument("--opendrive-1-8-1", type=pathlib.Path)
    arguments.add_argument("--keep", type=pathlib.Path, help="keep the XSDs here, one folder per table (outside the repository)")
    arguments.add_argument("--write", action="store_true", help="replace the shipped tables")
    options = arguments.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        scratch = pathlib.Path(scratch)
        subprocess.run([sys.executable, "-m", "pip", "download", "-q", "--no-deps", "-d", scratch, *WHEELS], check=True)
        for wheel in scratch.glob("*.whl"):
            zipfile.ZipFile(wheel).extractall(scratch)
        sources = {name: (title, scratch / folder) for name, (title, folder) in SOURCES.items()}
        if options.opendrive_1_8_1:
            sources["xodr-1.8"] = ("OpenDRIVE 1.8.1", options.opendrive_1_8_1)
        else:
            print("xodr-1.8: not compared, no folder was given")
        return compare(options, sources, scratch)


def compare(options, sources, scratch):
    different = 0
    for name, (title, folder) in sources.items():
        out = scratch / f"{name}.tbl"
        files = sorted(str(path) for path in folder.glob("*.xsd"))
        subprocess.run([options.tool, "compile", title, out, *files], check=True)
        shipped = TABLES / f"{name}.tbl"
        same = shipped.exists() and shipped.read_bytes() == out.read_bytes()
        print(f"{name}: {'agrees' if same else 'DIFFERS'}")
        different += not same
        if options.write:
            shutil.copyfile(out, shipped)
        if options.keep:
            shutil.copytree(folder, options.keep / name, dirs_exist_ok=True)
    return 1 if different and not options.write else 0


if __name__ == "__main__":
    sys.exit(main())

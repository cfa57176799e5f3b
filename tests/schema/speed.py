#!/usr/bin/env python3
"""Compares the CPU time of validation with the schema step of ASAM's bundle (Python's xmlschema on an
OpenDRIVE 1.8 map), in one run on one machine.

As in the bundle, xmlschema gets a tree parsed by lxml and lists all findings. Compiling the schema and
parsing the file do not count, for both. The bundle needs `xmlschema<4`.

    pip install 'lxml<6' 'xmlschema>=3.3.1,<4'
    speed.py --tool TARGET/release/deps/schema_tool-HASH --xsd FOLDER_OF_1.8_XSDS [--megabytes 1.3]
"""

import argparse
import pathlib
import re
import subprocess
import tempfile
import time

import lxml.etree as et
import xmlschema

ROOT = pathlib.Path(__file__).resolve().parents[2]
LANE = """<lane id="{0}" type="driving" level="false"><link/>
<width sOffset="0" a="3.5" b="1.0e-03" c="0.0" d="0.0"/>
<roadMark sOffset="0" type="solid" material="standard" color="white" width="0.13" laneChange="none"/></lane>
"""
ROAD = """<road name="r" length="100.0" id="{0}" junction="-1"><planView>
{1}</planView><elevationProfile>
{2}</elevationProfile><lanes><laneSection s="0">
<left>{3}</left><center><lane id="0" type="none" level="false"/></center><right>{4}</right></laneSection></lanes></road>
"""


def road(number):
    """Returns one road of about 4 kB."""
    geometry = "".join(
        f'<geometry s="{k * 12.5}" x="{number + k * 1.23456789e+01}" y="{k * -3.14159}" hdg="1.57" length="12.5"><line/></geometry>\n'
        for k in range(8)
    )
    elevation = "".join(f'<elevation s="{k * 25}.0" a="{k / 7:.12f}" b="0.0012" c="-1.0e-05" d="0"/>\n' for k in range(6))
    left, right = (LANE.format(2) + LANE.format(1)), (LANE.format(-1) + LANE.format(-2))
    return ROAD.format(number, geometry, elevation, left, right)


def main():
    arguments = argparse.ArgumentParser()
    arguments.add_argument("--tool", required=True)
    arguments.add_argument("--xsd", required=True, type=pathlib.Path)
    arguments.add_argument("--megabytes", type=float, default=1.3)
    options = arguments.parse_args()
    text = '<OpenDRIVE><header revMajor="1" revMinor="8"/>\n'
    number = 0
    while len(text) < options.megabytes * 1e6:
        text += road(number)
        number += 1
    text += "</OpenDRIVE>\n"
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "map.xodr"
        path.write_text(text)
        table = ROOT / "bundles/schema/tables/xodr-1.8.tbl"
        ours = subprocess.run([options.tool, "time", table, path], text=True, capture_output=True, check=True).stdout
        print(ours.strip())
        milliseconds = float(re.search(r"([\d.]+) ms on the CPU", ours).group(1))
        schema = xmlschema.XMLSchema11(str(options.xsd / "OpenDRIVE_Core.xsd"))
        tree = et.parse(str(path))
        started = time.process_time()
        errors = list(schema.iter_errors(tree))
        seconds = time.process_time() - started
    print(f"xmlschema {xmlschema.__version__}, lxml {et.__version__}: {len(text) / 1e6:.1f} MB, {len(errors)} findings, {seconds:.1f} s on the CPU")
    print(f"ratio {seconds * 1e3 / milliseconds:,.0f}")


if __name__ == "__main__":
    main()

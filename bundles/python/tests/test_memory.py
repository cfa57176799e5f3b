"""A large document is read in place."""

import json

import pytest
from big import big_map
from farm import QCBUS, serving

pytestmark = pytest.mark.skipif(not QCBUS.exists(), reason=f"the program is not installed beside Python: {QCBUS}")

SCRIPT = '''
import json
import qcbus

bundle = qcbus.Bundle("reader", version="1.0", kinds=["xodr"])


def private():
    """Returns the private bytes of this process. Shared mappings do not count: the kernel reports their pages as private
    until another process uses them."""
    kilobytes, is_shared = 0, False
    with open("/proc/self/smaps") as maps:
        for line in maps:
            first, *rest = line.split()
            if not first.endswith(":"):
                is_shared = rest[0].endswith("s")
            elif first in ("Private_Clean:", "Private_Dirty:") and not is_shared:
                kilobytes += int(rest[0])
    return kilobytes * 1024


@bundle.rule("example.org:xodr:1.0.0:all.read")
def all_read(doc, found):
    """Every element is read."""
    before = private()
    elements = widths = 0
    for element in doc.iter():
        elements += 1
        if element.get("a"):
            widths += 1
    told = {"before": before, "after": private(), "elements": elements, "widths": widths}
    found.issue(doc, json.dumps(told), level="information")


bundle.main()
'''


def test_what_a_large_map_costs_a_bundle(tmp_path):
    with serving(tmp_path, "--no-standard-bundles") as farm:
        farm.add("reader", farm.script(SCRIPT))

        def told(name, text):
            farm.wait(farm.put(name, text))
            [issue] = farm.result(name, "reader").iter("Issue")
            return json.loads(issue.get("description"))

        small = told("small.xodr", big_map(0))
        text = big_map(100)
        large = told("large.xodr", text)
        more = large["after"] - small["before"]
        print(f"{len(text):,} bytes, {large['elements']:,} elements: {more / 1e6:.1f} MB more than idle")
        assert large["elements"] == text.count("<") - text.count("</")
        assert large["widths"] == text.count("<width")
        assert more <= 60e6

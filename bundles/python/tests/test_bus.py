"""A bundle in Python on a running broker."""

import os
import signal
import subprocess
import sys
import time

import pytest
from farm import MAP, QCBUS, TEN_LINES, WATCHDOG, serving

pytestmark = pytest.mark.skipif(not QCBUS.exists(), reason=f"the program is not installed beside Python: {QCBUS}")


@pytest.fixture
def farm(tmp_path):
    with serving(tmp_path, "--no-standard-bundles") as farm:
        yield farm


def rule(body: str, head: str = "") -> str:
    lines = "\n".join(f"    {line}" for line in body.splitlines())
    return f'''
import qcbus
{head}
bundle = qcbus.Bundle("acme", version="1.0", kinds=["xodr"])

@bundle.rule("acme.example:xodr:1.0.0:it")
def it(doc, found):
    """It looks."""
{lines}

bundle.main()
'''


def test_ten_lines_beside_a_farm(tmp_path):
    with serving(tmp_path) as farm:
        farm.wait(farm.put("a.xodr"))
        assert farm.result("a.xodr") is None
        begun = time.monotonic()
        farm.add("acme", farm.script(TEN_LINES))
        verdict = farm.wait(farm.files / "a.xodr")
        print(f"found {time.monotonic() - begun:.2f} s after `bundle add`")
        assert verdict["warnings"] == 1
        [issue] = farm.result("a.xodr").iter("Issue")
        assert issue.get("description") == "road `17` has no name; give it one"
        assert issue.get("ruleUID") == "acme.example:xodr:1.0.0:road.named"
        [place] = issue.iter("FileLocation")
        assert (place.get("row"), place.get("column")) == ("3", "3")
        assert [it.get("xpath") for it in issue.iter("XMLLocation")] == ["/OpenDRIVE/road[@id='17']"]
        assert farm.peer("acme")["sandbox"]["state"] == "confined"
        farm.qcbus("bundle", "remove", "acme")
        assert farm.wait(farm.files / "a.xodr")["warnings"] == 0
        assert farm.result("a.xodr") is None


def test_an_exception_is_undetermined_with_its_traceback(farm):
    farm.add("acme", farm.script(rule("doc.root.find('road').get('id')[9]")))
    assert farm.wait(farm.put("a.xodr"))["verdict"] == "undetermined"
    [checker] = farm.result("a.xodr").iter("Checker")
    assert checker.get("status") == "error"
    assert "IndexError: string index out of range" in checker.get("summary")
    assert "acme.py\", line 9, in it" in checker.get("summary")
    assert farm.peer("acme")["restarts"] == 0


def test_half_a_file_is_not_accepted(farm):
    farm.add("acme", farm.script(TEN_LINES))
    for name, text in (("a.xodr", MAP[:60]), ("b.xodr", "")):
        assert farm.wait(farm.put(name, text))["verdict"] in ("rejected", "undetermined")
        [checker] = farm.result(name).iter("Checker")
        assert checker.get("status") == "skipped", checker.attrib


def test_what_a_confined_rule_may_and_may_not(farm):
    (farm.place / "beside.py").write_text("VALUE = 5\n")
    (farm.place / "secret.txt").write_text("x")
    body = f"""
import beside, colorsys, ctypes, socket, subprocess
assert beside.VALUE == 5
for what in (
    lambda: open({str(farm.place / "secret.txt")!r}),
    lambda: open("/etc/passwd"),
    lambda: open({str(farm.place / "written")!r}, "w"),
    lambda: socket.create_connection(("127.0.0.1", 9)),
    lambda: subprocess.run(["/bin/true"]),
    lambda: __import__("os").kill(1, 0),
):
    try:
        what()
    except OSError as error:
        found.fact(f"refused{{len(found)}}", type(error).__name__)
        found.issue(doc, type(error).__name__, level="information")
"""
    farm.add("acme", farm.script(rule(body)))
    if farm.peer("acme")["sandbox"]["state"] != "confined":
        pytest.skip(f"this kernel cannot confine a process: {farm.peer('acme')}")
    assert farm.wait(farm.put("a.xodr"))["verdict"] == "accepted", [it.attrib for it in farm.result("a.xodr").iter("Checker")]
    said = [it.get("description") for it in farm.result("a.xodr").iter("Issue")]
    assert said == ["PermissionError"] * 6
    assert not (farm.place / "written").exists()


def test_what_is_kept_of_a_job_is_of_no_use_in_the_next(farm):
    farm.add("acme", farm.script(rule(
        """
for element in kept:
    try:
        element.tag
    except qcbus.Closed:
        found.issue(doc, "closed", level="information")
kept.append(doc.root)
""", "kept = []")))  # fmt: skip
    for number in range(3):
        path = farm.put(f"{number}.xodr", MAP.replace("17", str(number)))
        verdict = farm.wait(path)
        assert (verdict["verdict"], verdict["information"]) == ("accepted", number)


def test_a_killed_bundle_costs_nothing(farm):
    farm.add("acme", farm.script(rule("import time\ntime.sleep(0.05)")))
    paths = [farm.put(f"{number}.xodr", MAP.replace("17", str(number))) for number in range(20)]
    os.kill(farm.peer("acme")["pid"], signal.SIGKILL)
    assert {farm.wait(path)["verdict"] for path in paths} == {"accepted"}
    assert farm.peer("acme")["restarts"] == 1


@pytest.mark.parametrize("end", ["os._exit(0)", "os.kill(os.getpid(), 11)", "sys.exit(0)", "os.abort()"])
def test_a_rule_that_ends_its_process_accepts_nothing(farm, end):
    farm.add("acme", farm.script(rule(f"import os, sys\n{end}")))
    assert farm.wait(farm.put("a.xodr"))["verdict"] == "undetermined"
    [checker] = farm.result("a.xodr").iter("Checker")
    assert checker.get("status") == "error"


def test_a_rule_that_never_comes_back_is_ended(tmp_path):
    with serving(tmp_path, "--no-standard-bundles", "--job-deadline", "1s") as farm:
        farm.add("acme", farm.script(rule('if doc.root.find("road[@id=\'1\']"):\n    while True: pass')))
        hanging, sound = farm.put("h.xodr", MAP.replace("17", "1")), farm.put("s.xodr")
        assert farm.wait(sound)["verdict"] == "accepted"
        assert farm.wait(hanging)["verdict"] == "undetermined"
        [checker] = farm.result("h.xodr").iter("Checker")
        assert checker.get("status") == "error", checker.attrib


def test_a_rule_that_takes_all_memory_or_says_too_much(farm):
    farm.add("acme", farm.script(rule(
        """
if doc.root.find("road[@id='1']"):
    bytearray(1 << 50)
for number in range(150_000):
    found.issue(doc.root, f"finding {number}", level="warning")
""")))  # fmt: skip
    flood = farm.wait(farm.put("f.xodr"))
    assert flood["verdict"] == "accepted"
    assert flood["warnings"] == 1001, "a thousand, and one with the number of the others"
    last = list(farm.result("f.xodr").iter("Issue"))[-1].get("description")
    assert "149000" in last.replace(",", ""), last
    assert farm.wait(farm.put("m.xodr", MAP.replace("17", "1")))["verdict"] == "undetermined"
    [checker] = farm.result("m.xodr").iter("Checker")
    assert "MemoryError" in checker.get("summary")


def test_numpy_leaves_a_bundle_confined(farm):
    pytest.importorskip("numpy")
    farm.add("acme", farm.script(rule("assert doc.table('road', 'length')['length'].numpy().sum() == 10",
                                      "import numpy")))  # fmt: skip
    assert farm.peer("acme")["sandbox"]["state"] == "confined", farm.peer("acme")
    assert farm.wait(farm.put("a.xodr"))["verdict"] == "accepted"


def test_a_scenario_sees_its_map(farm):
    text = rule(
        'found.issue(doc.map.find("road"), f"road {doc.map.roads[0].id} of {doc.map.kind}", level="information")\n'
        "assert [it.role for it in doc.linked] == ['map']\n"
        "assert doc.map.getroot().getparent() is None"
    )
    farm.add("acme", farm.script(text.replace('["xodr"]', '["xosc"]')))
    farm.put("a.xodr")
    scenario = farm.put("a.xosc", """<OpenSCENARIO><FileHeader revMajor="1" revMinor="3"/>
<RoadNetwork><LogicFile filepath="a.xodr"/></RoadNetwork></OpenSCENARIO>""")
    farm.wait(scenario)
    [issue] = farm.result("a.xosc").iter("Issue")
    assert issue.get("description") == "road 17 of xodr"
    assert "a.xodr" in str([it.attrib for it in issue.iter()])


def test_a_new_bundle_runs_as_its_page_says(tmp_path):
    with serving(tmp_path) as farm:
        farm.qcbus("bundle", "new", "my_Rules.x", "--python")
        made = tmp_path / "my_Rules.x"
        python = [sys.executable, "-m"]
        for words, said in (
            ([*python, "qcbus.test", "bundle.py"], "2 examples, 0 failed"),
            ([*python, "pytest", "-q", "-p", "no:cacheprovider"], "3 passed"),
        ):
            it = subprocess.run(words, cwd=made, capture_output=True, text=True, timeout=WATCHDOG)
            assert it.returncode == 0 and said in it.stdout, it.stdout + it.stderr
        farm.environment["PATH"] = f"{QCBUS.parent}:{farm.environment['PATH']}"
        ready = farm.qcbus("bundle", "add", "my_Rules.x", made / "bundle.py", told=True)
        assert "ready" in ready and "1 checker" in ready, ready
        narrow = MAP.replace("/>\n</Open", """><lanes><laneSection s="0"><center><lane id="0" type="none"/></center><right>
<lane id="-1" type="driving"><width sOffset="0" a="1" b="0" c="0" d="0"/></lane></right></laneSection></lanes></road>
</Open""")
        farm.wait(farm.put("a.xodr", narrow))
        [issue] = farm.result("a.xodr", "my_Rules.x").iter("Issue")
        assert issue.get("description") == "lane -1 of road `17` is 1 m wide; a driving lane needs 2 m"
        said = farm.qcbus("rule", "driving_lane_width")
        assert "wide enough for a vehicle" in said and "narrowest" in said, said
        # A saved script becomes a new version without a command to the broker.
        text = (made / "bundle.py").read_text().replace("level=\"warning\"", "level=\"error\"")
        (made / "coming").write_text(text)
        (made / "coming").rename(made / "bundle.py")
        farm.until(lambda: farm.wait(farm.files / "a.xodr")["errors"] == 1 + len([
            it for it in farm.result("a.xodr", "xodrBundle").iter("Issue") if it.get("level") == "1"
        ]))  # fmt: skip


def test_a_bundle_that_cannot_run_is_said_and_taken_out(farm):
    script = farm.script("import nothing_of_this_name\n")
    said = farm.qcbus("bundle", "add", "acme", sys.executable, script, code=None, told=True)
    assert "`acme` is not ready: it ended with exit code 1" in said
    assert "No module named 'nothing_of_this_name'" in farm.log()
    assert farm.peer("acme") is None
    assert farm.wait(farm.put("a.xodr"))["verdict"] == "undetermined", "no bundle has checked the file"

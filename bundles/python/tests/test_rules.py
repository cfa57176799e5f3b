"""Rules and bundles: findings, failures and rejected input."""

import re
import subprocess
import sys
import textwrap

import pytest
import qcbus
from looking import HEADER, bundle_of, run

MAP = f'<OpenDRIVE>{HEADER}\n<road id="1" length="5"/>\n<road id="2"/>\n</OpenDRIVE>'


def found(check, text=MAP, **given):
    said, unlooked = run(bundle_of(check, **given), text)
    assert not unlooked, unlooked
    return said


def test_a_finding_has_its_place():
    [said] = found(lambda doc, found: found.issue(doc.find("road"), "a road", attribute="length"), level="warning")
    assert said == {
        "checker": "check_looking_looks",
        "text": "a road",
        "level": "warning",
        "uid": "example.org:xodr:1.0.0:it.looks",
        "row": 2,
        "column": 14,
        "xpath": "/OpenDRIVE/road[@id='1']/@length",
    }


def test_a_finding_at_the_document_and_with_more_places():
    def check(doc, found):
        road = doc.find("road[2]")
        found.issue(doc, "all of it", level="information")
        found.issue(road, "two").here("first").road("2", 1.0).at(doc.find("road"), "second").point(1, 2, 3)
        assert len(found) == 2 and found

    assert [(it["xpath"], it["level"]) for it in found(check)] == [
        ("/OpenDRIVE", "information"), ("/OpenDRIVE/road[@id='2']", "error"),
    ]  # fmt: skip
    text = MAP.replace('length="5"/>', 'length="5"><lanes><laneSection s="0"><right><lane id="-1"/></right></laneSection></lanes></road>')

    def model(doc, found):
        road = doc.roads[0]
        for place in (road, road.sections[0], road.sections[0].lanes[0]):
            found.issue(place, "here")

    assert [it["xpath"].rpartition("/")[2] for it in found(model, text)] == [
        "road[@id='1']", "laneSection", "lane[@id='-1']",
    ]  # fmt: skip


def test_an_exception_is_the_error_of_its_checker_with_its_traceback():
    bundle = qcbus.Bundle("two", version="1.0")

    @bundle.rule("example.org:xodr:1.0.0:one")
    def one(doc, found):
        """It fails."""
        found.issue(doc.root, "found before")
        {}["missing"]

    @bundle.rule("example.org:xodr:1.0.0:other")
    def other(doc, found):
        """It goes on."""
        found.issue(doc.root, "found after")

    said, unlooked = run(bundle, MAP)
    assert [it["text"] for it in said] == ["found before", "found after"]
    [(checker, why)] = unlooked
    assert checker == "check_two_one"
    assert why.startswith("the rule raised KeyError: 'missing'\n")
    assert "test_rules.py" in why and "in one" in why and '{}["missing"]' in why


@pytest.mark.parametrize("what", ["SystemExit(3)", "KeyboardInterrupt()", "MemoryError()", "RecursionError('deep')"])
def test_whatever_a_rule_raises_ends_nothing_but_its_checker(what):
    def check(doc, found):
        raise eval(what)

    said, [(_, why)] = run(bundle_of(check), MAP)
    assert not said and why.startswith(f"the rule raised {what.partition('(')[0]}")


@pytest.mark.parametrize("text", ["", "<OpenDRIVE>", MAP[:-5], "no XML", MAP + "<more/>"])
def test_no_rule_looks_at_half_a_file(text):
    def check(doc, found):
        raise AssertionError("the rule ran")

    said, [(checker, why)] = run(bundle_of(check), text)
    assert (said, checker) == ([], "check_looking_looks")
    assert why == "the file is not well-formed XML, so only a part of it can be read"


def test_what_is_said_after_the_rule_has_come_back_is_refused():
    kept = []
    found(lambda doc, found: kept.extend([found, found.issue(doc.root, "reported"), doc.root]))
    with pytest.raises(qcbus.Closed):
        kept[0].issue(kept[2], "too late")
    with pytest.raises(qcbus.Closed):
        kept[1].level("warning")


def test_an_element_of_another_job_is_no_place():
    kept = []
    found(lambda doc, found: kept.append(doc.root))
    _, [(_, why)] = run(bundle_of(lambda doc, found: found.issue(kept[0], "of another job")), MAP)
    assert why.startswith("the rule raised Closed: ")
    _, [(_, why)] = run(
        bundle_of(lambda doc, found: found.issue(doc.root, "here").at(kept[0], "of another job")), MAP
    )
    assert why.startswith("the rule raised Closed: ")
    another = []

    def outer(doc, found):
        run(bundle_of(lambda inner, _: another.append(found.issue(inner.root, "of another job"))), MAP)

    said, _ = run(bundle_of(outer), MAP)
    assert (said, another) == ([], []), "the document is open but belongs to another rule"


def test_what_a_finding_cannot_be():
    def fails(check, text):
        _, [(_, why)] = run(bundle_of(check), MAP)
        assert re.search(text, why), why

    fails(lambda doc, found: found.issue("road", "x"), "must point at an element, a road, .* of its job, not at str")
    fails(lambda doc, found: found.issue(doc, "x", level="fatal"), "`fatal` is not a level")
    fails(lambda doc, found: found.issue(doc, "x", uid="a.b:xodr:1.0.0:c"), "is not a UID of this rule; its UIDs are `example")
    fails(lambda doc, found: found.issue(doc, 5), "TypeError")
    fails(lambda doc, found: found.param("no"), "declares no parameter `no`")


def test_parameters_have_their_defaults():
    seen = []
    params = [
        qcbus.Param("most", 2.5, "the maximum that is allowed", unit="m"),
        qcbus.Param("strict", True, "whether it is strict"),
        qcbus.Param("word", "x", "a word"),
    ]
    found(lambda doc, found: seen.append((found.params, found.param("most"), found.version)), params=params)
    assert seen == [({"most": 2.5, "strict": True, "word": "x"}, 2.5, (1, 8))]


def test_rules_rest_on_others_and_on_versions():
    bundle = qcbus.Bundle("gates", version="1.0")

    @bundle.rule("example.org:xodr:1.0.0:first")
    def first(doc, found):
        """It finds."""
        found.issue(doc.root, "wrong")

    @bundle.rule("example.org:xodr:1.0.0:second", after=[first])
    def second(doc, found):
        """It never runs."""
        raise AssertionError("the previous rule found an error")

    @bundle.rule("example.org:xodr:1.9.0:third", versions="1.9.0..")
    def third(doc, found):
        """It does not apply."""
        raise AssertionError("the file is older")

    said, unlooked = run(bundle, MAP)
    assert [it["checker"] for it in said] == ["check_gates_first"]
    assert [checker for checker, _ in unlooked] == ["check_gates_second", "check_gates_third"]


def test_what_no_bundle_can_be():
    bundle = qcbus.Bundle("b", version="1.0")

    def check(doc, found):
        """It looks."""

    with pytest.raises(ValueError, match="is not a valid bundle name"):
        qcbus.Bundle("a b", version="1.0")
    with pytest.raises(ValueError, match="`pdf` is not a file kind; the kinds are"):
        qcbus.Bundle("a", version="1.0", kinds=["pdf"])
    with pytest.raises(ValueError, match="must have at least one kind"):
        qcbus.Bundle("a", version="1.0", kinds=[])
    with pytest.raises(ValueError, match="must have a UID"):
        bundle.rule()(check)
    for uid in ("named", "a.b:xodr:1.0.0", "a-b.c:xodr:1.0.0:d", "a.b:xodr:1.0.0:d e", "a.b:x:y:z", ""):
        with pytest.raises(ValueError, match="is not a UID: it must have a domain"):
            bundle.rule(uid)(check)
    with pytest.raises(ValueError, match="`bad` is not a level"):
        bundle.rule("a.b:xodr:1.0.0:c", level="bad")(check)
    with pytest.raises(ValueError, match="has no docstring"):
        bundle.rule("a.b:xodr:1.0.0:c")(lambda doc, found: None)
    with pytest.raises(ValueError, match="after.*`no`"):
        bundle.rule("a.b:xodr:1.0.0:c", after=["no"])(check)
    with pytest.raises(ValueError, match="versions"):
        bundle.rule("a.b:xodr:1.0.0:c", versions="newest")(check)
    bundle.rule("a.b:xodr:1.0.0:c")(check)
    with pytest.raises(ValueError, match="already has a rule `check_b_check`"):
        bundle.rule("a.b:xodr:1.0.0:d")(check)
    run(bundle, MAP)
    with pytest.raises(RuntimeError, match="declare all rules before"):
        bundle.rule("a.b:xodr:1.0.0:d", id="another")(check)


SCRIPT = '''
import qcbus

bundle = qcbus.Bundle("acme", version="1.0", kinds=["xodr"])


@bundle.rule(
    "acme.example:xodr:1.0.0:road.named",
    level="warning",
    good=['<road id="1" name="a"/>'],
    bad=[('<road id="1"/>', "/OpenDRIVE/road[@id='1']"), '<road id="2" name=""/>'],
)
def road_named(doc, found):
    """Every road has a name."""
    print("looking")
    for road in doc.iter("road"):
        if not road.get("name"):
            found.issue(road, f"road `{road.get('id')}` has no name; give it one")


bundle.main()
'''


def ran(directory, *arguments, **given):
    return subprocess.run(
        [sys.executable, *arguments], cwd=directory, capture_output=True, text=True, timeout=120, **given
    )


def test_a_script_on_one_file(tmp_path):
    (tmp_path / "acme.py").write_text(SCRIPT)
    (tmp_path / "a.xodr").write_text(MAP)
    it = ran(tmp_path, "acme.py", "a.xodr")
    assert it.returncode == 0, it.stderr
    assert it.stdout.splitlines() == [
        "a.xodr:2:1: warning: road `1` has no name; give it one [acme.example:xodr:1.0.0:road.named]",
        "a.xodr:3:1: warning: road `2` has no name; give it one [acme.example:xodr:1.0.0:road.named]",
    ]
    assert it.stderr == "looking\n", "the output of rules is not among the findings"
    assert ran(tmp_path, "acme.py", "--wrong").returncode == 2
    assert ran(tmp_path, "acme.py", "none.xodr").returncode == 2
    imported = ran(tmp_path, "-c", "import acme; print(len(acme.bundle.rules))")
    assert (imported.returncode, imported.stdout) == (0, "1\n"), imported.stderr


def test_a_script_as_a_module_of_asam(tmp_path):
    (tmp_path / "acme.py").write_text(SCRIPT)
    (tmp_path / "a.xodr").write_text(MAP)
    (tmp_path / "c.xml").write_text(
        '<Config><Param name="InputFile" value="a.xodr"/><CheckerBundle application="acme">'
        '<Param name="resultFile" value="r.xqar"/><Checker checkerId="check_acme_road_named"/></CheckerBundle></Config>'
    )
    it = ran(tmp_path, "acme.py", "-c", "c.xml")
    assert it.returncode == 0, it.stderr
    result = (tmp_path / "r.xqar").read_text()
    assert 'name="acme"' in result and result.count("<Issue ") == 2


def test_examples_are_tried(tmp_path):
    (tmp_path / "acme.py").write_text(SCRIPT)
    it = ran(tmp_path, "-m", "qcbus.test", "acme.py")
    assert (it.returncode, it.stdout.splitlines()[-1]) == (0, "3 examples, 0 failed"), it.stdout + it.stderr
    (tmp_path / "acme.py").write_text(SCRIPT.replace("road[@id='1']\")", "road[@id='9']\")").replace("name=\"a\"", ""))
    it = ran(tmp_path, "-m", "qcbus.test", "acme.py")
    assert it.returncode == 1
    assert it.stdout.splitlines()[-1] == "3 examples, 2 failed"
    assert "check_acme_road_named good 1: FAILED\nexpected\n  nothing\nbut found" in it.stdout
    assert "expected\n  /OpenDRIVE/road[@id='9']" in it.stdout
    (tmp_path / "none.py").write_text("x = 1")
    assert ran(tmp_path, "-m", "qcbus.test", "none.py").returncode == 2
    assert ran(tmp_path, "-m", "qcbus.test").returncode == 2
    missing = ran(tmp_path, "-m", "qcbus.test", "nowhere.py")
    assert (missing.returncode, missing.stderr) == (2, "nowhere.py: script not found\n")


def test_examples_are_tests_of_pytest(tmp_path):
    (tmp_path / "acme.py").write_text(SCRIPT)
    (tmp_path / "test_it.py").write_text("from acme import bundle\n")
    for given in ("acme.py", "test_it.py"):
        it = ran(tmp_path, "-m", "pytest", "-q", given)
        assert "3 passed" in it.stdout, it.stdout + it.stderr
    (tmp_path / "acme.py").write_text(SCRIPT.replace('bad=[(', 'bad=["<road name=\'x\'/>", ('))
    it = ran(tmp_path, "-m", "pytest", "-q", "acme.py")
    assert "1 failed, 3 passed" in it.stdout and "found nothing in" in it.stdout, it.stdout


def test_the_version_is_one(tmp_path):
    said = ran(tmp_path, "-c", textwrap.dedent("""
        import importlib.metadata, qcbus
        print(qcbus.__version__ == importlib.metadata.version("qcbus"))
    """))
    assert said.stdout == "True\n", said.stderr

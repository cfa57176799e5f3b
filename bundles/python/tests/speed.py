"""Compares the speed with lxml, parsing included: ``python tests/speed.py [MEGABYTES]``. A benchmark, not a test."""

import sys
import time

import qcbus
from big import big_map
from looking import bundle_of, run
from lxml import etree


def seconds(what):
    best = None
    for _ in range(3):
        begun = time.perf_counter()
        value = what()
        took = time.perf_counter() - begun
        best = took if best is None else min(best, took)
    return best, value


def main() -> None:
    text = big_map(int(sys.argv[1]) if len(sys.argv) > 1 else 100).encode()

    def theirs(visit):
        return visit(etree.fromstring(text, etree.XMLParser(huge_tree=True)))

    def ours(visit):
        told = []
        run(bundle_of(lambda doc, found: told.append(visit(doc))), text)
        return told[0]

    def all_elements(doc):
        return sum(1 for _ in doc.iter())

    def sum_of_attributes(doc):
        return sum(float(it.get("length")) for it in doc.iter("geometry"))

    def sum_of_numbers(doc):
        return sum(it.float("length") for it in doc.iter("geometry"))

    def sum_of_column(doc):
        return sum(memoryview(doc.table("geometry", "length")["length"]))

    def sum_of_array(doc):
        return float(doc.table("geometry", "length")["length"].numpy().sum())

    def alone(visit):
        """Measures without parsing, which the broker does once for all bundles."""
        told = []

        def check(doc, found):
            told.append(seconds(lambda: visit(doc)))

        run(bundle_of(check), text)
        return told[0]

    print(f"{len(text):,} bytes, qcbus {qcbus.__version__}, lxml {etree.__version__}")
    for name, lxml_does, we_do in (
        ("every element", all_elements, all_elements),
        ("an attribute of each geometry", sum_of_attributes, sum_of_numbers),
        ("the same as a column", sum_of_attributes, sum_of_column),
        ("the same as an array", sum_of_attributes, sum_of_array),
    ):
        theirs_took, theirs_said = seconds(lambda: theirs(lxml_does))
        ours_took, ours_said = seconds(lambda: ours(we_do))
        alone_took, _ = alone(we_do)
        assert theirs_said == ours_said, (name, theirs_said, ours_said)
        print(
            f"{name}: lxml {theirs_took:.3f} s; qcbus {ours_took:.3f} s ({theirs_took / ours_took:.1f} times), "
            f"on the bus, without parsing, {alone_took:.3f} s ({theirs_took / alone_took:.1f} times)"
        )


if __name__ == "__main__":
    main()

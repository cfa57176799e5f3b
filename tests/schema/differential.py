#!/usr/bin/env python3
"""Compares the schema validator with lxml (OpenDRIVE up to 1.7, OpenSCENARIO) and with Python's
xmlschema (OpenDRIVE 1.8) on real files and on seeded mutants.

    pip install lxml xmlschema
    differential.py --tool TARGET/release/deps/schema_tool-HASH --xsd DIR [--files DIR]... [--mutants N]
                    [--seed N]... [--record FILE]

DIR has one folder of XSDs per table, named like the table: `xodr-1.7/`, `xosc-1.3/` (the script
`tables_agree.py --keep DIR` makes it). The validator ignores namespaces, so the oracles get the files
without a default namespace, or with that of the schema.

Every seed makes `--mutants` mutants. Whole files are judged once, independent of the seeds. All figures
count every disagreement, except the last one. It leaves out those where `proof.py` proves the other
validator wrong.
"""

import argparse
import collections
import json
import pathlib
import random
import re
import subprocess
import sys
import tempfile

import lxml.etree as et
import xmlschema

from mutate import elements, mutation, splice
from oracle import Oracle
from proof import Case, explanation

ROOT = pathlib.Path(__file__).resolve().parents[2]
TABLES = ROOT / "bundles/schema/tables"
DOCUMENTS = ROOT / "bundles/schema/tests/documents"

Row = collections.namedtuple("Row", "path cut text")
Ours = collections.namedtuple("Ours", "verdict row end_row offset code words")


class Tally:
    """Counts of some rows."""

    def __init__(self, name):
        self.name = name
        self.total = self.agreed = self.invalid = self.rows = self.rows_agreed = 0
        self.reasons = collections.Counter()

    def print(self):
        """Prints one line, and one line per class of disagreement."""
        proven = sum(count for reason, count in self.reasons.items() if reason)
        print(
            f"{self.name}: {self.agreed} of {self.total} verdicts agree ({share(self.agreed, self.total)}), {self.invalid} invalid;"
            f" with {proven} proven defects {share(self.agreed + proven, self.total)};"
            f" first rows: {self.rows_agreed} of {self.rows} ({share(self.rows_agreed, self.rows)})"
        )
        for reason, count in self.reasons.most_common():
            print(f"    {count} × {reason or 'UNEXPLAINED'}")

    def __iadd__(self, other):
        for field in ("total", "agreed", "invalid", "rows", "rows_agreed"):
            setattr(self, field, getattr(self, field) + getattr(other, field))
        self.reasons += other.reasons
        return self


def share(part, whole):
    return f"{100 * part / max(whole, 1):.3f} %"


def table_for(text):
    """Returns the table for the version in a file's header."""
    kind, header = ("xodr", r"<header\b[^>]*>") if "<OpenDRIVE" in text else ("xosc", r"<FileHeader\b[^>]*>")
    found = re.search(header, text)
    major = re.search(r'revMajor\s*=\s*["\'](\d+)', found.group(0)) if found else None
    minor = re.search(r'revMinor\s*=\s*["\'](\d+)', found.group(0)) if found else None
    name = f"{kind}-{major.group(1)}.{minor.group(1)}" if major and minor else None
    return name if name and (TABLES / f"{name}.tbl").exists() else None


def read(path):
    """Returns the text of a UTF-8 file without its declaration, or None."""
    try:
        text = path.read_bytes().decode("utf-8-sig").replace("\r\n", "\n")
        text = re.sub(r"^\s*<\?xml[^>]*\?>", "", text)
        et.fromstring(text.encode())
        return text
    except (UnicodeDecodeError, et.XMLSyntaxError):
        return None


def judge_ours(tool, table, texts):
    """Returns our verdict and first finding per text."""
    with tempfile.TemporaryDirectory() as folder:
        suffix = table.split("-")[0]
        names = []
        for index, text in enumerate(texts):
            name = pathlib.Path(folder) / f"{index}.{suffix}"
            name.write_text(text, newline="")
            names.append(str(name))
        done = subprocess.run(
            [tool, "validate", str(TABLES / f"{table}.tbl")], input="\n".join(names), text=True, capture_output=True, check=True
        )
    found = []
    for line in done.stdout.splitlines():
        verdict, row, end_row, offset, code, words = line.split("\t")[1:]
        found.append(Ours(verdict, int(row), int(end_row), int(offset), code, words))
    return found


def base_documents(options, oracles):
    """Returns (path, text, table) of our own documents and of the real files."""
    bases = []
    own = sorted(DOCUMENTS.glob("*.x*"))
    for path in own + sorted(p for f in options.files for p in f.rglob("*") if p.suffix in (".xodr", ".xosc")):
        text = read(path)
        name = table_for(text) if text else None
        if path in own:
            name = path.name.rsplit("-", 1)[0]  # made from the table of this name
        if name in oracles:
            bases.append((path, text, name))
    print(f"{len(bases)} base documents ({len(own)} our own), {len(oracles)} schemas")
    return bases


def whole_files(bases, oracles):
    """Returns every document, also for the other versions of its kind."""
    work = {name: [] for name in oracles}
    for path, text, name in bases:
        kind = name.split("-")[0]
        for other in oracles:
            if other == name or (other.startswith(kind) and not oracles[other].slow and len(text) < 200_000):
                work[other].append(Row(path, None, text))
    return work


def mutants(bases, oracles, seed, wanted):
    """Returns this number of mutants, half of them of our own documents."""
    rng = random.Random(seed)
    work = {name: [] for name in oracles}
    small = [base for base in bases if len(base[1]) < 60_000]
    own = [base for base in small if DOCUMENTS in base[0].parents]
    trees = {}
    while wanted:
        path, text, name = rng.choice(own if rng.random() < 0.5 and own else small)
        if oracles[name].slow and len(text) > 25_000:
            continue
        if path not in trees:
            trees[path] = elements(text)
        cut = mutation(rng, text, trees[path])
        if cut is not None:
            work[name].append(Row(path, cut, splice(text, cut)))
            wanted -= 1
    return work


def compare(title, work, oracles, options, record):
    """Judges all rows with both validators."""
    tally = Tally(title)
    judge = lambda table, texts: judge_ours(options.tool, table, texts)
    for name, rows in work.items():
        oracle = oracles[name]
        for row, ours in zip(rows, judge(name, [row.text for row in rows]), strict=True):
            wanted, line = oracle.judge(row.text)
            tally.total += 1
            tally.invalid += wanted == "invalid"
            if ours.verdict != wanted:
                words = oracle.words() if wanted == "invalid" else ""
                reason = explanation(Case(row.text, oracle, judge, wanted, ours))
                tally.reasons[reason] += 1
                print(f"  {reason or 'UNEXPLAINED'}", name, row.path, row.cut, wanted, ours.verdict, ours.words, words, sep="\n      ")
                continue
            tally.agreed += 1
            if wanted == "invalid" and not oracle.slow:
                tally.rows += 1
                same = line in (ours.row, ours.end_row)
                tally.rows_agreed += same
                if not same and options.verbose:
                    print("ROW", name, row.path, row.cut, line, ours.row, ours.end_row, ours.words, oracle.words())
            if row.cut and DOCUMENTS in row.path.parents and wanted != "ill-formed":
                at, remove, insert = row.cut
                record.append({"document": row.path.name, "at": at, "remove": remove, "insert": insert, "valid": wanted == "valid"})
    tally.print()
    sys.stdout.flush()
    return tally


def main():
    arguments = argparse.ArgumentParser()
    arguments.add_argument("--tool", required=True)
    arguments.add_argument("--xsd", required=True, type=pathlib.Path)
    arguments.add_argument("--files", action="append", default=[], type=pathlib.Path)
    arguments.add_argument("--mutants", type=int, default=5000, help="for each seed")
    arguments.add_argument("--seed", type=int, action="append", default=[])
    arguments.add_argument("--record", type=pathlib.Path, help="write the verdicts over our own documents")
    arguments.add_argument("--verbose", action="store_true", help="print first rows that differ")
    options = arguments.parse_args()
    seeds = options.seed or [1]
    oracles = {f.name: Oracle(f.name, f) for f in sorted(options.xsd.iterdir()) if (TABLES / f"{f.name}.tbl").exists()}
    bases = base_documents(options, oracles)
    record = []
    files = compare("whole files", whole_files(bases, oracles), oracles, options, record)
    mutated = Tally("all mutants")
    for seed in seeds:
        work = mutants(bases, oracles, seed, options.mutants)
        mutated += compare(f"seed {seed}", work, oracles, options, record)
    mutated.print()
    pooled = Tally("pooled")
    pooled += files
    pooled += mutated
    pooled.print()
    if options.record:
        random.Random(seeds[0]).shuffle(record)
        head = {"seed": seeds[0], "oracles": f"lxml {et.__version__}, xmlschema {xmlschema.__version__}"}
        lines = [json.dumps(head)] + [json.dumps(row) for row in record[:800]]
        options.record.write_text("\n".join(lines) + "\n")
    return 0 if pooled.agreed >= 0.999 * pooled.total and None not in pooled.reasons else 1


if __name__ == "__main__":
    sys.exit(main())

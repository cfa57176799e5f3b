#!/usr/bin/env python3
"""Compares the schema validator with lxml (OpenDRIVE up to 1.7, OpenSCENARIO) and with Python's
xmlschema (OpenDRIVE 1.8) on real files and on seeded mutants.

    pip install lxml xmlschema
    differential.py --tool TARGET/release/examples/schema_tool --xsd DIR [--files DIR]... [--mutants N]
                    [--seed N] [--record FILE]

DIR holds one folder of XSDs per table, named like the table: `xodr-1.7/`, `xosc-1.3/` (the script
`tables_agree.py --keep DIR` makes it). Namespaces: the validator disregards them, so the oracles get
the files without a default namespace, or with the schema's own.
"""

import argparse
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

ROOT = pathlib.Path(__file__).resolve().parents[2]
TABLES = ROOT / "bundles/schema/tables"
DOCUMENTS = ROOT / "bundles/schema/tests/documents"
VIRES = {"xodr-1.1", "xodr-1.2"}


class Oracle:
    """The other validator for one table."""

    def __init__(self, name, folder):
        self.name = name
        self.slow = name == "xodr-1.8"
        main = [p for p in sorted(folder.glob("*.xsd")) if re.search(r"_core|_Core|OpenDRIVE_1|OpenSCENARIO", p.name)][0]
        self.schema = xmlschema.XMLSchema11(str(main)) if self.slow else et.XMLSchema(et.parse(str(main)))

    def judge(self, text):
        """(verdict, line of the first error)"""
        text = re.sub(r"\sxmlns=(\"[^\"]*\"|'[^']*')", "", text)
        if self.name in VIRES:
            text = text.replace("<OpenDRIVE", '<OpenDRIVE xmlns="www.vires.com"', 1)
        try:
            tree = et.fromstring(text.encode())
        except et.XMLSyntaxError:
            return "ill-formed", 0
        if self.slow:
            return ("valid" if self.schema.is_valid(tree) else "invalid"), 0
        valid = self.schema.validate(tree)
        line = 0 if valid else self.schema.error_log[0].line
        return ("valid" if valid else "invalid"), line


def explanation(oracle, wanted, verdict, words):
    """Why the other validator is known to be wrong here; see docs/schema.md."""
    if (wanted, verdict) != ("valid", "invalid"):
        return None
    if not oracle.slow and re.match(r'"[+-]?[0-9.]+[eE]" is no value', words):
        return "libxml2 takes an exponent without digits for a number"
    if words.startswith('"NaN"'):
        return "xmlschema and libxml2 let NaN pass every bound"
    if oracle.slow and "white space between its tags" in words:
        return "xmlschema lets white space pass in an element without content"
    if oracle.slow and words.startswith("<userData> may not contain text"):
        return "xmlschema lets text pass where the content is xs:any"
    if oracle.slow and "refers to nothing" in words and "<connection>" in words:
        return "xmlschema misses references from elements whose type an alternative chose"
    return None


def table_for(text):
    """The table a file's header asks for."""
    kind, header = ("xodr", r"<header\b[^>]*>") if "<OpenDRIVE" in text else ("xosc", r"<FileHeader\b[^>]*>")
    found = re.search(header, text)
    major = re.search(r'revMajor\s*=\s*["\'](\d+)', found.group(0)) if found else None
    minor = re.search(r'revMinor\s*=\s*["\'](\d+)', found.group(0)) if found else None
    name = f"{kind}-{major.group(1)}.{minor.group(1)}" if major and minor else None
    return name if name and (TABLES / f"{name}.tbl").exists() else None


def read(path):
    """Text of a UTF-8 file without its declaration, or None."""
    try:
        text = path.read_bytes().decode("utf-8-sig").replace("\r\n", "\n")
        text = re.sub(r"^\s*<\?xml[^>]*\?>", "", text)
        et.fromstring(text.encode())
        return text
    except (UnicodeDecodeError, et.XMLSyntaxError):
        return None


def judge_ours(tool, table, texts):
    """Our verdicts: (verdict, row, row of the tag's end, code, text) per text."""
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
    return [line.split("\t")[1:] for line in done.stdout.splitlines()]


def main():
    arguments = argparse.ArgumentParser()
    arguments.add_argument("--tool", required=True)
    arguments.add_argument("--xsd", required=True, type=pathlib.Path)
    arguments.add_argument("--files", action="append", default=[], type=pathlib.Path)
    arguments.add_argument("--mutants", type=int, default=5000)
    arguments.add_argument("--seed", type=int, default=1)
    arguments.add_argument("--record", type=pathlib.Path, help="write the verdicts over our own documents")
    arguments.add_argument("--verbose", action="store_true", help="print first rows that differ")
    options = arguments.parse_args()
    rng = random.Random(options.seed)
    oracles = {f.name: Oracle(f.name, f) for f in sorted(options.xsd.iterdir()) if (TABLES / f"{f.name}.tbl").exists()}

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

    work = {name: [] for name in oracles}
    for path, text, name in bases:
        kind = name.split("-")[0]
        for other in oracles:
            if other == name or (other.startswith(kind) and not oracles[other].slow and len(text) < 200_000):
                work[other].append((path, None, text))
    real = sum(len(rows) for rows in work.values())
    small = [base for base in bases if len(base[1]) < 60_000]
    trees = {}
    made = 0
    while made < options.mutants:
        path, text, name = rng.choice([b for b in small if b[0] in own] if rng.random() < 0.5 and own else small)
        if oracles[name].slow and len(text) > 25_000:
            continue
        if path not in trees:
            trees[path] = elements(text)
        cut = mutation(rng, text, trees[path])
        if cut is not None:
            work[name].append((path, cut, splice(text, cut)))
            made += 1
    print(f"{real} rows of whole files, {made} mutants, seed {options.seed}")

    agreed = rows_agreed = rows_all = total = invalid = 0
    unexplained = 0
    disagreements, record = [], []
    for name, rows in work.items():
        ours = judge_ours(options.tool, name, [text for _, _, text in rows])
        for (path, cut, text), (verdict, row, end_row, code, words) in zip(rows, ours, strict=True):
            wanted, line = oracles[name].judge(text)
            total += 1
            invalid += wanted == "invalid"
            if verdict == wanted:
                agreed += 1
                if wanted == "invalid" and not oracles[name].slow:
                    rows_all += 1
                    same = line in (int(row), int(end_row))
                    rows_agreed += same
                    if not same and options.verbose:
                        print("ROW", name, path, cut, line, row, end_row, words, str(oracles[name].schema.error_log[:1]))
                if cut and path in own and wanted != "ill-formed":
                    record.append({"document": path.name, "at": cut[0], "remove": cut[1], "insert": cut[2], "valid": wanted == "valid"})
            else:
                why = ""
                if wanted == "invalid" and not oracles[name].slow:
                    why = str(oracles[name].schema.error_log[:1])
                reason = explanation(oracles[name], wanted, verdict, words)
                unexplained += reason is None
                disagreements.append((reason or "UNEXPLAINED", name, str(path), cut, wanted, verdict, words, why))
    print(f"{agreed} of {total} verdicts agree ({100 * agreed / total:.3f} %), {invalid} invalid; unexplained: {unexplained}")
    print(f"{rows_agreed} of {rows_all} first rows agree with lxml")
    for row in disagreements:
        print(*row, sep="\n    ")
    if options.record:
        rng.shuffle(record)
        head = {"seed": options.seed, "oracles": f"lxml {et.__version__}, xmlschema {xmlschema.__version__}"}
        lines = [json.dumps(head)] + [json.dumps(row) for row in record[:800]]
        options.record.write_text("\n".join(lines) + "\n")
    return 0 if agreed >= 0.999 * total and unexplained == 0 else 1


if __name__ == "__main__":
    sys.exit(main())

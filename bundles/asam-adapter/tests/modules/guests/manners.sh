# What every guest begins with: where its input is, and how a result is written.
config="$ASAM_QC_FRAMEWORK_CONFIG_FILE"
value() { sed -n "s/.*name=\"$1\" value=\"\([^\"]*\)\".*/\1/p" "$config" | head -n 1; }
input="$(value InputFile)"
result="$(value resultFile)"
checker() { echo "<Checker checkerId=\"$1\" status=\"$2\" description=\"what $1 checks\" summary=\"\">$3</Checker>"; }
issue() { echo "<Issue issueId=\"0\" level=\"$1\" ruleUID=\"guest.example:xodr:1.0.0:rule\" description=\"$2\">
<Locations description=\"here\"><XMLLocation xpath=\"/OpenDRIVE\"/></Locations></Issue>"; }
begin() { echo "<CheckerResults version=\"1.0.0\"><CheckerBundle name=\"guest\" version=\"7.1\" build_date=\"\" description=\"a guest\" summary=\"\"><Param name=\"InputFile\" value=\"${1:-$input}\"/>"; }
end() { echo "</CheckerBundle></CheckerResults>"; }
polite() { { begin; checker one completed; checker two completed; end; } > "$result"; }
# Over the files from which it is learned what it has, every guest is polite.
case "$input" in */sample.xodr | */sample.xosc) polite; exit 0;; esac

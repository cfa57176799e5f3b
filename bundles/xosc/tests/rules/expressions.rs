//! Tests of expressions from simulators' own tests, in scenarios. The whole bundle reports each
//! faulty expression exactly once, wherever it is, and does not report the good one.

use std::path::Path;

use qcbus_sdk::{Issue, Level, Listener, Loaded, Outcome, Plan, check};
use qcbus_xosc::BUNDLE;

/// Kind of attribute that the expression is written for.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    /// `delay`, a double in the schema.
    Double,
    /// `revMinor` is the only such attribute. It has many other effects, so a declared value
    /// replaces it.
    UnsignedShort,
}

/// The expression, its kind, and the rule that reports it in a declared value.
const FAULTY: &[(&str, Kind, &str)] = &[
    ("${2/0}", Kind::Double, EVALUATION),
    ("${34/$doubleVal}", Kind::Double, EVALUATION),
    ("${pow(0,-0.5)}", Kind::Double, EVALUATION),
    ("${sqrt(-9)}", Kind::Double, EVALUATION),
    ("${pow(-3,-0.5)}", Kind::Double, EVALUATION),
    ("${pow(-3,0.5)}", Kind::Double, EVALUATION),
    ("${1.80E308}", Kind::Double, EVALUATION),
    ("${5f}", Kind::Double, OPERATORS),
    ("${5}}", Kind::Double, EVALUATION),
    ("${$timeParam + 1}", Kind::Double, EVALUATION),
    ("${$stringParam + 1}", Kind::Double, EVALUATION),
    ("${powerer(2, 3)}", Kind::Double, OPERATORS),
    ("${3^$foo}", Kind::Double, OPERATORS),
    ("${2*3+4^23}", Kind::Double, OPERATORS),
    ("${1 and 1}", Kind::Double, "expressions_type_of_boolean"),
    ("${2_3}", Kind::Double, OPERATORS),
    (
        "${65535 +1}",
        Kind::UnsignedShort,
        "expressions_type_casting",
    ),
    (
        "${pow(2)}",
        Kind::Double,
        "expressions_arguments_of_operators",
    ),
    (
        "${$nobody + 1}",
        Kind::Double,
        "parameters_parameter_declaration_parameter_scope",
    ),
    ("${}", Kind::Double, EVALUATION),
];

const OPERATORS: &str = "data_type_allowed_operators";
const EVALUATION: &str = "expressions_evaluation_of_expressions_possible";

/// Parameters of the expressions.
const PARAMETERS: &str = r#"
<ParameterDeclaration name="doubleVal" parameterType="double" value="0.0"/>
<ParameterDeclaration name="timeParam" parameterType="dateTime" value="2026-01-31T12:00:00"/>
<ParameterDeclaration name="stringParam" parameterType="string" value="text"/>
<ParameterDeclaration name="foo" parameterType="double" value="2"/>
<ParameterDeclaration name="delay" parameterType="double" value="1"/>
<ParameterDeclaration name="x0" parameterType="double" value="0"/>
<ParameterDeclaration name="x1" parameterType="double" value="30"/>
<ParameterDeclaration name="y0" parameterType="double" value="0"/>
<ParameterDeclaration name="y1" parameterType="double" value="40"/>
<ParameterDeclaration name="speed" parameterType="double" value="10"/>
"#;

const GOOD: &str = "${$delay + ((($x1 - $x0)* 2 + ($y1 - $y0)*2 )*0.5 / $speed) + sqrt(9)}";

/// Returns a valid scenario with one further declaration and the delay of the only condition.
fn scenario(minor: u8, declaration: &str, delay: &str) -> String {
    format!(
        r#"<?xml version="1.0" encoding="UTF-8"?>
<OpenSCENARIO>
<FileHeader revMajor="1" revMinor="{minor}" date="2026-01-01T00:00:00" description="test" author="qcbus"/>
<ParameterDeclarations>{PARAMETERS}{declaration}</ParameterDeclarations>
<CatalogLocations/>
<RoadNetwork><LogicFile filepath="Town05"/></RoadNetwork>
<Entities><ScenarioObject name="Ego"><ExternalObjectReference name="host"/></ScenarioObject></Entities>
<Storyboard>
<Init><Actions><Private entityRef="Ego"><PrivateAction>
<VisibilityAction graphics="true" sensors="true" traffic="true"/>
</PrivateAction></Private></Actions></Init>
<StopTrigger>
<ConditionGroup>
<Condition name="end" delay="{delay}" conditionEdge="none">
<ByValueCondition><SimulationTimeCondition value="60" rule="greaterThan"/></ByValueCondition>
</Condition>
</ConditionGroup>
</StopTrigger>
</Storyboard>
</OpenSCENARIO>
"#
    )
}

struct Heard<'p> {
    plan: &'p Plan,
    findings: Vec<String>,
}

impl Listener for Heard<'_> {
    fn ended(&mut self, checker: usize, issues: Vec<Issue>, _: Outcome) {
        let id = self.plan.checkers()[checker].facts.id;
        let name = id.split_once("_xosc_").map_or(id, |(_, name)| name);
        let name = name.strip_suffix("_backport").unwrap_or(name);
        for issue in issues {
            // Stories may be missing here, and some parameters are unused.
            let expected =
                issue.level == Level::Information || issue.description.contains("<Story>");
            if !expected {
                self.findings.push(format!("{name}: {}", issue.description));
            }
        }
    }
}

fn findings(plan: &Plan, text: String) -> Vec<String> {
    let loaded = Loaded::from_bytes(Path::new("test.xosc"), text.into_bytes()).unwrap();
    let mut heard = Heard {
        plan,
        findings: Vec::new(),
    };
    check(plan, &loaded.subject(&BUNDLE).unwrap(), &mut heard);
    heard.findings
}

fn declaration(kind: Kind, expression: &str) -> String {
    let data_type = match kind {
        Kind::Double => "double",
        Kind::UnsignedShort => "unsignedShort",
    };
    format!(
        r#"<ParameterDeclaration name="tested" parameterType="{data_type}" value="{expression}"/>"#
    )
}

#[test]
fn faulty_value_is_reported_once_by_its_rule() {
    let plan = Plan::by_default(&BUNDLE);
    for minor in 1..=4 {
        for (expression, kind, rule) in FAULTY {
            let text = scenario(minor, &declaration(*kind, expression), "$tested");
            let found = findings(&plan, text);
            let only = found.len() == 1 && found.iter().all(|one| one.starts_with(rule));
            assert!(only, "{expression} in 1.{minor}: {found:#?}");
        }
    }
}

#[test]
fn faulty_attribute_is_reported_once_by_schema_or_rule() {
    let plan = Plan::by_default(&BUNDLE);
    for minor in 1..=4 {
        for (expression, kind, rule) in FAULTY {
            if *kind != Kind::Double {
                continue;
            }
            let found = findings(&plan, scenario(minor, "", expression));
            let by = |name: &str| found.iter().all(|one| one.starts_with(name));
            let only = found.len() == 1 && (by(rule) || by("xml_valid_schema"));
            assert!(only, "{expression} in 1.{minor}: {found:#?}");
        }
    }
}

#[test]
fn valid_expression_is_not_reported() {
    let plan = Plan::by_default(&BUNDLE);
    for minor in 1..=4 {
        let found = findings(
            &plan,
            scenario(minor, &declaration(Kind::Double, GOOD), GOOD),
        );
        assert_eq!(found, [""; 0], "1.{minor}");
    }
}

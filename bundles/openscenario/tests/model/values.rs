//! Tests that attributes are read in their context.

use crate::common::with_scenario;
use qcbus_openscenario::{Form, Reading, Scenario, ValueFaultKind};

/// Returns one declaration for each entry of name, type and value.
fn declare(parameters: &[(&str, &str, &str)]) -> String {
    let each = parameters.iter().map(|(name, kind, value)| {
        format!(
            "<ParameterDeclaration name=\"{name}\" parameterType=\"{kind}\" value=\"{value}\"/>"
        )
    });
    format!(
        "<ParameterDeclarations>{}</ParameterDeclarations>",
        each.collect::<String>()
    )
}

fn number(scenario: &Scenario<'_>, element: &str, attribute: &str) -> Option<f64> {
    scenario
        .elements(element)
        .next()
        .and_then(|element| element.number(attribute))
}

/// Returns the number that a speed with this `value` has under these declared parameters.
fn speed(parameters: &[(&str, &str, &str)], value: &str) -> (Option<f64>, Vec<ValueFaultKind>) {
    let body = format!(
        "{}<Entities/><Storyboard><Init><Actions><Private entityRef=\"a\"><PrivateAction><LongitudinalAction>\
         <SpeedAction><SpeedActionTarget><AbsoluteTargetSpeed value=\"{value}\"/></SpeedActionTarget>\
         </SpeedAction></LongitudinalAction></PrivateAction></Private></Actions></Init></Storyboard>",
        declare(parameters)
    );
    with_scenario(&body, |scenario| {
        assert_eq!(scenario.form(), Form::Scenario);
        let kinds = scenario.faults().iter().map(|fault| fault.kind).collect();
        (number(scenario, "AbsoluteTargetSpeed", "value"), kinds)
    })
}

#[test]
fn literals_parameters_and_expressions_give_numbers() {
    let v = [
        ("v", "double", "12.5"),
        ("n", "int", "3"),
        ("text", "string", "7"),
    ];
    assert_eq!(speed(&v, " 4 "), (Some(4.0), vec![]));
    assert_eq!(speed(&v, "$v"), (Some(12.5), vec![]));
    assert_eq!(speed(&v, "$n"), (Some(3.0), vec![]));
    assert_eq!(speed(&v, "$text"), (Some(7.0), vec![]));
    assert_eq!(speed(&v, "${$v * $n}"), (Some(37.5), vec![]));
}

#[test]
fn fault_is_listed_once_without_follow_up_faults() {
    let broken = [
        ("a", "double", "abc"),
        ("b", "double", "${$a + 1}"),
        ("c", "double", "$b"),
    ];
    assert_eq!(speed(&broken, "$c"), (None, vec![ValueFaultKind::Declared]));
    assert_eq!(speed(&[], "$c"), (None, vec![ValueFaultKind::Undeclared]));
    assert_eq!(
        speed(&[], "${$c + 2/0}"),
        (None, vec![ValueFaultKind::Undeclared])
    );
}

#[test]
fn each_fault_has_its_kind() {
    let some = [
        ("v", "double", "1.5"),
        ("n", "int", "3"),
        ("flag", "boolean", "true"),
        ("text", "string", "fast"),
    ];
    for (value, kind) in [
        ("${1/0}", ValueFaultKind::Evaluation),
        ("${3^2}", ValueFaultKind::Operator),
        ("${pow(2)}", ValueFaultKind::Arguments),
        ("${$flag + 1}", ValueFaultKind::Types),
        ("${$flag}", ValueFaultKind::Result),
        ("$flag", ValueFaultKind::Parameter),
        ("$text", ValueFaultKind::Parameter),
        ("1$v", ValueFaultKind::Embedded),
    ] {
        let (read, kinds) = speed(&some, value);
        assert_eq!((read, kinds), (None, vec![kind]), "{value}");
    }
}

#[test]
fn declaration_uses_only_earlier_declarations() {
    let early = [("a", "double", "${$b + 1}"), ("b", "double", "2")];
    assert_eq!(speed(&early, "$a"), (None, vec![ValueFaultKind::Order]));
    let itself = [("a", "double", "$a")];
    assert_eq!(
        speed(&itself, "1"),
        (Some(1.0), vec![ValueFaultKind::Order])
    );
}

#[test]
fn innermost_declaration_wins_and_siblings_are_invisible() {
    let story = |name: &str, declared: &str| {
        format!(
            "<Story name=\"{name}\">{declared}<Act name=\"a\"><StartTrigger><ConditionGroup><Condition \
             name=\"c\" delay=\"$wait\" conditionEdge=\"none\"/></ConditionGroup></StartTrigger></Act></Story>"
        )
    };
    let body = format!(
        "{}<Entities/><Storyboard>{}{}</Storyboard>",
        declare(&[("wait", "double", "1")]),
        story("one", &declare(&[("wait", "double", "2")])),
        story("two", "")
    );
    with_scenario(&body, |scenario| {
        let delays: Vec<_> = scenario
            .elements("Condition")
            .map(|one| one.number("delay"))
            .collect();
        assert_eq!(delays, [Some(2.0), Some(1.0)]);
        assert!(scenario.faults().is_empty());
    });
}

#[test]
fn unknown_enumeration_word_is_fault() {
    let event = |priority: &str| {
        format!(
            "{}<Entities/><Storyboard><Story name=\"s\"><Act name=\"a\"><ManeuverGroup name=\"g\"><Maneuver \
             name=\"m\"><Event name=\"e\" priority=\"{priority}\"/></Maneuver></ManeuverGroup></Act></Story>\
             </Storyboard>",
            declare(&[
                ("good", "string", "override"),
                ("bad", "string", "sometimes")
            ])
        )
    };
    let read = |priority: &str| {
        with_scenario(&event(priority), |scenario| {
            let word = scenario
                .elements("Event")
                .next()
                .and_then(|event| event.word("priority"));
            let kinds: Vec<_> = scenario.faults().iter().map(|fault| fault.kind).collect();
            (word.map(|word| word.into_owned()), kinds)
        })
    };
    assert_eq!(read("$good"), (Some("override".to_owned()), vec![]));
    assert_eq!(read("$bad"), (None, vec![ValueFaultKind::Word]));
}

#[test]
fn text_that_looks_like_expression_is_kept() {
    let body = "<Entities><ScenarioObject name=\"${Ego car}\"/><ScenarioObject name=\"costs 5$\"/></Entities>";
    with_scenario(body, |scenario| {
        let names: Vec<_> = scenario.entities().names().map(str::to_owned).collect();
        assert_eq!(names, ["${Ego car}", "costs 5$"]);
        let kinds: Vec<_> = scenario.faults().iter().map(|fault| fault.kind).collect();
        assert_eq!(kinds, [ValueFaultKind::InText]);
    });
}

#[test]
fn declaration_names_are_never_replaced() {
    let body = format!(
        "{}<Entities/><Storyboard/>",
        declare(&[("$old", "double", "1")])
    );
    with_scenario(&body, |scenario| {
        let declaration = scenario.root().parameter("old").map(|one| one.name);
        assert_eq!((declaration, scenario.faults().len()), (Some("old"), 0));
    });
}

#[test]
fn chain_of_ten_thousand_declarations_does_not_overflow() {
    let mut parameters = String::from(
        "<ParameterDeclarations><ParameterDeclaration name=\"p0\" parameterType=\"int\" value=\"1\"/>",
    );
    for number in 1..10_000 {
        parameters += &format!(
            "<ParameterDeclaration name=\"p{number}\" parameterType=\"int\" value=\"${{$p{} + 1}}\"/>",
            number - 1
        );
    }
    let body = format!(
        "{parameters}</ParameterDeclarations><Entities><ScenarioObject name=\"$p9999\"/></Entities>"
    );
    with_scenario(&body, |scenario| {
        let object = scenario.elements("ScenarioObject").next();
        assert_eq!(
            object.map(|object| object.read("name")),
            Some(Reading::Value(qcbus_openscenario::Value::Text(
                "10000".into()
            )))
        );
    });
}

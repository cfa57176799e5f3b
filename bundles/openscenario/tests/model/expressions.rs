//! Tests of expressions: their values, and the faults of invalid ones.

use qcbus_openscenario::expr::{
    Evaluated, Fault, FaultKind, Newer, Operand, Value, evaluate, is_expression, names,
};

const DELAY: &str = "${$delay + ((($x1 - $x0)* 2 + ($y1 - $y0)*2 )*0.5 / $speed) + sqrt(9)}";

/// Returns the parameters of all tests.
fn parameter(name: &str) -> Operand {
    let value = match name {
        "doubleVal" | "zero" => Value::Double(0.0),
        "delay" => Value::Double(1.5),
        "half" | "speed" => Value::Double(0.5),
        "x0" | "y0" | "one" => Value::Integer(1),
        "x1" | "y1" => Value::Integer(3),
        "smallest" => Value::Integer(i64::MIN),
        "infinite" => Value::Double(f64::INFINITY),
        "nan" => Value::Double(f64::NAN),
        "yes" => Value::Boolean(true),
        "stringParam" => return Operand::Text("string"),
        "timeParam" => return Operand::Text("dateTime"),
        "faulty" => return Operand::Unresolved,
        "counter" => return Operand::Variable,
        _ => return Operand::Undeclared,
    };
    Operand::Value(value)
}

fn in_version(text: &str, minor: u16) -> Result<Evaluated, Fault> {
    evaluate(text, (1, minor), &parameter)
}

fn value(inner: &str) -> Result<Value, Fault> {
    in_version(&format!("${{{inner}}}"), 4).map(|evaluated| evaluated.value)
}

/// Returns the kind of a fault as one word, and its position.
fn fault(text: &str) -> (&'static str, usize) {
    let Err(fault) = in_version(text, 3) else {
        return ("no fault", 0);
    };
    let kind = match fault.kind {
        FaultKind::Operator => "operator",
        FaultKind::Arguments => "arguments",
        FaultKind::Types => "types",
        FaultKind::Evaluation => "evaluation",
        FaultKind::Undeclared(_) => "undeclared",
        FaultKind::Variable(_) => "variable",
        FaultKind::Unresolved => "unresolved",
        FaultKind::Limit => "limit",
    };
    (kind, fault.at)
}

/// Checks the expected values of the reference implementation's own tests.
#[test]
fn reference_test_expressions_evaluate_as_expected() {
    for (text, kind) in [
        ("${2/0}", "evaluation"),
        ("${34/$doubleVal}", "evaluation"),
        ("${pow(0,-0.5)}", "evaluation"),
        ("${sqrt(-9)}", "evaluation"),
        ("${pow(-3,-0.5)}", "evaluation"),
        ("${pow(-3,0.5)}", "evaluation"),
        ("${1.80E308}", "evaluation"),
        ("${1.797e308 + 1e308}", "evaluation"),
        ("${5f}", "operator"),
        ("${5}}", "evaluation"),
        ("${}", "evaluation"),
        ("${$timeParam + 1}", "evaluation"),
        ("${$stringParam + 1}", "evaluation"),
        ("${powerer(2, 3)}", "operator"),
        ("${3^$foo}", "operator"),
        ("${2*3+4^23}", "operator"),
        ("${1 and 1}", "types"),
        ("${2_3}", "operator"),
    ] {
        assert_eq!(fault(text).0, kind, "{text}");
    }
    let delay = in_version(DELAY, 1).unwrap();
    assert_eq!(delay.value, Value::Double(12.5));
    assert!(delay.uses_parameters && delay.newer.is_empty() && delay.imprecise.is_none());
    // The expression does not check whether the value fits its attribute.
    assert_eq!(value("65535 +1"), Ok(Value::Integer(65536)));
}

#[test]
fn every_grammar_production_is_evaluated() {
    use Value::{Boolean, Double, Integer};
    for (inner, expected) in [
        (" 7\t\r\n", Integer(7)),
        ("false or true or false", Boolean(true)),
        ("true or true and false", Boolean(true)),
        ("not true or true", Boolean(true)),
        ("not true and false", Boolean(false)),
        ("not not $yes", Boolean(true)),
        ("not(true)", Boolean(false)),
        ("10 - 4 - 3", Integer(3)),
        ("2 + 3 * 4", Integer(14)),
        ("2 - -3", Integer(5)),
        ("1--2", Integer(3)),
        ("- - 2", Integer(2)),
        ("-2 * -3", Integer(6)),
        ("12 / 4 * 3", Double(9.0)),
        ("7 / 2", Double(3.5)),
        ("-7 % 3", Integer(-1)),
        ("7 % -3", Integer(1)),
        ("-7.5 % 2", Double(-1.5)),
        ("$smallest % -1", Integer(0)),
        ("(2 + 3) * 4", Integer(20)),
        ("0", Integer(0)),
        ("0.50", Double(0.5)),
        ("1e3", Double(1000.0)),
        ("15E-1", Double(1.5)),
        ("1.5e+3", Double(1500.0)),
        ("1e3+3", Double(1003.0)),
        ("pi", Double(std::f64::consts::PI)),
        ("$one", Integer(1)),
        ("$one*$half", Double(0.5)),
        ("round(2.5)", Integer(3)),
        ("round(-2.5)", Integer(-3)),
        ("round(0.49999999999999994)", Integer(0)),
        ("floor(-0.5)", Integer(-1)),
        ("ceil(35.5+1)", Integer(37)),
        ("round(1e30)", Double(1e30)),
        ("floor(-9223372036854775808.0)", Integer(i64::MIN)),
        (
            "ceil(9223372036854775808.0)",
            Double(9_223_372_036_854_775_808.0),
        ),
        ("sqrt(9)", Double(3.0)),
        ("pow(2, 3)", Double(8.0)),
        ("pow(-2, -1)", Double(-0.5)),
        ("sin(0) + cos(0) + tan(0)", Double(1.0)),
        ("asin(0) + acos(1) + atan(0)", Double(0.0)),
        ("sign(-0.5)", Integer(-1)),
        ("sign(0.0)", Integer(0)),
        ("abs(-3)", Integer(3)),
        ("abs(-0.5)", Double(0.5)),
        ("max(2, 3)", Integer(3)),
        ("max(2, 1.0)", Double(2.0)),
        ("min(2.5, 3)", Double(2.5)),
        ("min($infinite, 5)", Double(5.0)),
        ("round ( (2.5) )", Integer(3)),
    ] {
        assert_eq!(value(inner), Ok(expected), "{inner}");
    }
    let blanks = in_version(" \n${ 1 }\t", 3).unwrap();
    assert_eq!(blanks.value, Integer(1));
    assert!(!blanks.uses_parameters);
}

#[test]
fn foreign_syntax_is_reported_at_its_position() {
    for (text, kind, at) in [
        ("${2 ** 3}", "operator", 4),
        ("${7 // 2}", "operator", 4),
        ("${1 == 1}", "operator", 4),
        ("${1 <= 1}", "operator", 4),
        ("${$one = 1}", "operator", 7),
        ("${!true}", "operator", 2),
        ("${true && true}", "operator", 7),
        ("${true || true}", "operator", 7),
        ("${'a'}", "operator", 2),
        ("${[1]}", "operator", 2),
        ("${1 ? 2 : 3}", "operator", 4),
        ("${3 \u{2212} 1}", "operator", 4),
        ("${3\u{a0}- 1}", "operator", 3),
        ("${.}", "operator", 2),
        ("${e}", "operator", 2),
        ("${speed}", "operator", 2),
        ("${True}", "operator", 2),
        ("${1 AND 2}", "operator", 4),
        ("${7 mod 2}", "operator", 4),
        ("${sin}", "arguments", 2),
        ("${2 * sin 3}", "arguments", 6),
        ("${sin()}", "arguments", 2),
        ("${sin(1, 2)}", "arguments", 2),
        ("${pow(2)}", "arguments", 2),
        ("${pow(1,2,3)}", "arguments", 2),
        ("${pow(,3)}", "arguments", 6),
        ("${pow(2,)}", "arguments", 8),
    ] {
        assert_eq!(fault(text), (kind, at), "{text}");
    }
}

#[test]
fn invalid_expression_is_reported_at_its_position() {
    for (text, kind, at) in [
        ("5", "evaluation", 0),
        (" $half", "evaluation", 1),
        ("${ }", "evaluation", 3),
        ("${1", "evaluation", 3),
        ("${1 +", "evaluation", 5),
        ("${1}${2}", "evaluation", 4),
        ("${1} m", "evaluation", 5),
        ("${(1}", "evaluation", 2),
        ("${pow(1, 2}", "evaluation", 5),
        ("${1)}", "evaluation", 3),
        ("${()}", "evaluation", 3),
        ("${1 2}", "evaluation", 4),
        ("${2 $half}", "evaluation", 4),
        ("${2(3)}", "evaluation", 3),
        ("${1,5}", "evaluation", 3),
        ("${+5}", "evaluation", 2),
        ("${2 * }", "evaluation", 6),
        ("${true and}", "evaluation", 10),
        ("${$}", "evaluation", 2),
        ("${$1}", "evaluation", 2),
        ("${$(var x)}", "evaluation", 2),
        ("${007}", "evaluation", 2),
        ("${.5}", "evaluation", 2),
        ("${5.}", "evaluation", 2),
        ("${1.2.3}", "evaluation", 2),
        ("${1e}", "evaluation", 2),
        ("${1e-05}", "evaluation", 2),
        ("${0x1F}", "operator", 2),
        ("${9223372036854775808}", "evaluation", 2),
        ("${1 + 9223372036854775807}", "evaluation", 4),
        ("${-$smallest}", "evaluation", 2),
        ("${abs($smallest)}", "evaluation", 2),
        ("${1 % 0}", "evaluation", 4),
        ("${1 % $zero}", "evaluation", 4),
        ("${2 * asin(1.5)}", "evaluation", 6),
        ("${acos(-2)}", "evaluation", 2),
        ("${$infinite}", "evaluation", 2),
        ("${sin($infinite)}", "evaluation", 2),
        ("${max(1, $nan)}", "evaluation", 9),
        ("${1 + true}", "types", 6),
        ("${1 + not true}", "types", 6),
        ("${-true}", "types", 3),
        ("${not 1}", "types", 6),
        ("${true or (1 + 2)}", "types", 10),
        ("${sin($yes)}", "types", 6),
        ("${$none}", "undeclared", 2),
        ("${1 + $counter}", "variable", 6),
        ("${$faulty}", "unresolved", 2),
    ] {
        assert_eq!(fault(text), (kind, at), "{text}");
    }
}

#[test]
fn only_most_severe_fault_is_reported() {
    for (text, kind, at) in [
        // Syntax errors come first.
        ("${$none + 1 and 2/0 ^ 2}", "operator", 20),
        ("${$none + }", "evaluation", 10),
        // Unknown names come before types, and types before values.
        ("${1 and $none}", "undeclared", 8),
        ("${not (1 + $none)}", "undeclared", 11),
        ("${2/0 + true}", "types", 8),
        ("${$stringParam and 1}", "types", 19),
        // A part without a value still has a type.
        ("${$faulty + true}", "types", 12),
        ("${($faulty + 1) and true}", "types", 2),
        ("${$faulty + 2/0}", "evaluation", 13),
        ("${$faulty + $none}", "undeclared", 12),
        ("${$faulty and $faulty}", "unresolved", 2),
        // Among equal faults, the first one is reported.
        ("${$none + $counter}", "undeclared", 2),
        ("${1/0 + sqrt(-1)}", "evaluation", 3),
        ("${1 and true and 2}", "types", 2),
    ] {
        assert_eq!(fault(text), (kind, at), "{text}");
    }
    let undeclared = in_version("${$a + $b}", 1).unwrap_err();
    assert_eq!(undeclared.kind, FaultKind::Undeclared("a".to_owned()));
    let variable = in_version("${$counter}", 1).unwrap_err();
    assert_eq!(variable.kind, FaultKind::Variable("counter".to_owned()));
}

#[test]
fn faults_explain_the_correction() {
    for (text, expected) in [
        (
            "${3^2}",
            "`^` is not part of the expression language; write a power as `pow(2, 3)`",
        ),
        (
            "${Sin(3)}",
            "`Sin` is not part of the expression language; words are case-sensitive; write `sin`",
        ),
        (
            "${3\u{a0}* 2}",
            "the character U+00A0 is not part of the expression language; the allowed signs are `+ - * / % ( ) ,`",
        ),
        (
            "${pow(2)}",
            "`pow` takes two arguments, `pow(x, y)`, found 1",
        ),
        (
            "${sqrt 2}",
            "`sqrt` takes one argument, `sqrt(x)`, found no brackets",
        ),
        ("${1 and true}", "`and` takes booleans, found a number"),
        ("${2 - $yes}", "`-` takes numbers, found a boolean"),
        (
            "${5f}",
            "`5f` is not a number: numbers are written like `2`, `0.5` or `1.5e-3`, without units and separators",
        ),
        (
            "${5}}",
            "an expression must be the whole value, but `}` follows its `}`",
        ),
        ("${2/0}", "division by zero: the right operand of `/` is 0"),
        ("${sqrt(-9)}", "`sqrt` takes no negative number, found -9"),
        (
            "${$timeParam}",
            "`$timeParam` is of type dateTime; expressions take numbers and booleans",
        ),
        (
            "${$counter}",
            "`$counter` is a variable; expressions take parameters only",
        ),
    ] {
        let fault = in_version(text, 3).unwrap_err();
        assert_eq!(fault.to_string(), expected, "{text}");
    }
}

#[test]
fn version_decides_which_functions_are_known() {
    let text = "${sin(cos(0)) * sin(1) + sqrt(4) + max(1, 2)}";
    let newer = in_version(text, 2).unwrap().newer;
    let since = (1, 3);
    let expected = [("sin", 2), ("cos", 6), ("max", 35)];
    assert_eq!(newer, expected.map(|(name, at)| Newer { name, since, at }));
    assert_eq!(in_version(text, 3).unwrap().newer, []);
    assert_eq!(in_version("${sqrt(4)}", 0).unwrap().newer, []);
    assert!(in_version("${pi}", 4).is_ok() && evaluate("${pi}", (2, 0), &parameter).is_ok());
    let newer = in_version("${2 * pi}", 3).unwrap().newer;
    let (name, since, at) = ("pi", (1, 4), 6);
    assert_eq!(newer, [Newer { name, since, at }]);
}

#[test]
fn lost_precision_is_noted() {
    for (text, at) in [
        ("${9007199254740993 + 0.5}", Some(19)),
        ("${1 + sqrt(9007199254740993)}", Some(6)),
        ("${1e-200 * 1e-200}", Some(9)),
        ("${1e-200 / 1e200}", Some(9)),
        ("${pow(10, -400)}", Some(2)),
        ("${1e-400}", Some(2)),
        ("${9007199254740992 + 0.5}", None),
        ("${9007199254740993 + 1}", None),
        ("${0.0 * 5}", None),
        ("${1 / $infinite}", None),
        ("${1.5 - 1.5}", None),
        ("${0.0e-400}", None),
    ] {
        let imprecise = in_version(text, 3).unwrap().imprecise;
        assert_eq!(imprecise.map(|imprecise| imprecise.at), at, "{text}");
    }
}

#[test]
fn parameter_names_are_found_in_faulty_expressions() {
    assert_eq!(
        names("${$a * ($b_2+$a)}"),
        [("a", 2), ("b_2", 8), ("a", 13)]
    );
    assert_eq!(
        names(" ${2 ^^ $a$b $ $1 }${$c"),
        [("a", 8), ("b", 10), ("c", 21)]
    );
    assert_eq!(names("costs $five"), []);
    assert_eq!(names("${é$é$x"), [("x", 7)]);
    assert!(is_expression(" \t\r\n${") && is_expression("${1}"));
    assert!(!is_expression("$a") && !is_expression("a ${1}") && !is_expression("\u{a0}${1}"));
}

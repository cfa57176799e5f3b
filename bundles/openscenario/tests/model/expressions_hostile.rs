//! Tests of hostile texts: endless, deep, incomplete and random ones.

use qcbus_openscenario::expr::{
    Evaluated, Fault, FaultKind, MAX_LENGTH, Operand, Value, evaluate, names,
};

fn evaluated(text: &str) -> Result<Evaluated, Fault> {
    evaluate(text, (1, 3), &|name| match name {
        "zero" => Operand::Value(Value::Integer(0)),
        "half" => Operand::Value(Value::Double(0.5)),
        "smallest" => Operand::Value(Value::Integer(i64::MIN)),
        "yes" => Operand::Value(Value::Boolean(true)),
        "stringParam" => Operand::Text("string"),
        "faulty" => Operand::Unresolved,
        "counter" => Operand::Variable,
        _ => Operand::Undeclared,
    })
}

fn is_too_much(text: &str) -> bool {
    evaluated(text).is_err_and(|fault| fault.kind == FaultKind::Limit)
}

#[test]
fn long_and_deep_expressions_are_bounded() {
    let wrapped = |left: &str, middle: &str, right: &str, times: usize| {
        format!("${{{}{middle}{}}}", left.repeat(times), right.repeat(times))
    };
    for (left, middle, right) in [
        ("(", "1", ")"),
        ("-", "1", ""),
        ("not ", "true", ""),
        ("abs(", "1", ")"),
    ] {
        assert!(
            evaluated(&wrapped(left, middle, right, 64)).is_ok(),
            "{left}"
        );
        for times in [65, 3000, 100_000] {
            assert!(is_too_much(&wrapped(left, middle, right, times)), "{left}");
            assert!(is_too_much(&wrapped(left, "", "", times)), "{left}");
        }
    }
    // Adjacent brackets and chains of operators add no depth.
    let wide = format!("${{{}1}}", "(1)+".repeat(4000));
    assert_eq!(evaluated(&wide).unwrap().value, Value::Integer(4001));
    let longest = format!("${{{}1}}", "1-".repeat((MAX_LENGTH - 4) / 2));
    assert!(evaluated(&longest).is_ok());
    let long = format!("${{{}1}}", "$a+".repeat(1 << 20));
    assert!(is_too_much(&long));
    assert_eq!(names(&long).len(), 1 << 20);
    let digits = format!("${{{}}}", "9".repeat(16_000));
    assert!(evaluated(&digits).unwrap_err().text.len() < 300);
}

/// Checks that every text has a value or a fault, and that positions are within the text.
#[test]
fn arbitrary_texts_make_no_evaluation_panic() {
    const SEEDS: [&str; 6] = [
        "${$zero + ((($half - $half)* 2 + ($half - 1)*2 )*0.5 / $half) + sqrt(9)}",
        "${not (true or false) and not not $yes}",
        "${max(pow(2, 3), -1.5e-3 % 7) / round($half)}",
        "${$faulty + $none - $stringParam * $counter}",
        "${9223372036854775807 * $smallest - 1e308}",
        " ${ ((((1)))) }\u{2212}é",
    ];
    const PIECES: [&str; 24] = [
        "$", "{", "}", "(", ")", ",", ".", "+", "-", "*", "/", "%", "^", "e", "0", "9", " ",
        "not ", " and ", "$zero", "sin(", "_", "é", "\u{0}",
    ];
    let mut dice = Dice(0x9e37_79b9_7f4a_7c15);
    for round in 0..50_000 {
        let mut chars: Vec<char> = SEEDS[dice.below(SEEDS.len())].chars().collect();
        if round % 5 == 0 {
            chars = vec!['$', '{'];
        }
        for _ in 0..=dice.below(8) {
            let at = dice.below(chars.len() + 1);
            let end = (at + dice.below(3)).min(chars.len());
            let piece = PIECES[dice.below(PIECES.len())];
            chars.splice(at..end, piece.chars());
        }
        let text: String = chars.into_iter().collect();
        for (name, at) in names(&text) {
            assert!(text[at + 1..].starts_with(name), "{text}");
        }
        match evaluated(&text) {
            Ok(evaluated) => {
                assert!(!matches!(evaluated.value, Value::Double(x) if !x.is_finite()));
            }
            Err(fault) => {
                assert!(text.is_char_boundary(fault.at), "{text}: {fault:?}");
                assert!(
                    !fault.text.is_empty() && fault.text.len() < 300,
                    "{text}: {fault:?}"
                );
            }
        }
    }
}

/// A cheap random generator with the same choices on every machine.
struct Dice(u64);

impl Dice {
    fn below(&mut self, end: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        usize::try_from(self.0 >> 33).unwrap_or(0) % end.max(1)
    }
}

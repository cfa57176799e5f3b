//! Tests of patterns: each line has a pattern, texts that match, and texts that do not.

use qcbus_schema::{Pattern, PatternError};

/// Pattern, matching texts, other texts. The sign `␣` separates the texts, and `∅` means none.
const CASES: &[(&str, &str, &str)] = &[
    // Anchors: the whole text must match, and `^` and `$` are ordinary characters.
    ("", "", "a"),
    ("abc", "abc", "␣ab␣abcd␣xabc␣ABC"),
    ("^a$", "^a$", "a␣^a"),
    ("a^b", "a^b", "ab"),
    ("[A-Z]{2}", "DE", "DEU␣xDE␣D␣␣de"),
    // Choices and groups.
    ("a|b", "a␣b", "ab␣␣c"),
    ("a||b", "a␣b␣", "ab"),
    ("(a|b)c", "ac␣bc", "c␣abc␣a"),
    ("(|a)b", "b␣ab", "a␣aab"),
    ("()", "", "a"),
    ("((a)(b(c)))", "abc", "ab"),
    ("abc|de", "abc␣de", "abde␣ab"),
    // Quantifiers.
    ("a?", "␣a", "aa"),
    ("a*", "␣a␣aaaa", "b␣ab"),
    ("a+", "a␣aaa", "␣ba"),
    ("a{3}", "aaa", "aa␣aaaa"),
    ("a{2,}", "aa␣aaaaa", "a␣"),
    ("a{0,2}", "␣a␣aa", "aaa"),
    ("a{0}", "", "a"),
    ("a{0}b?", "␣b", "a␣ab"),
    ("(ab|c){2,3}", "abc␣ccab␣cc", "c␣abcabc␣abababab"),
    ("(a{2}){3}", "aaaaaa", "aaaaa␣aaaaaaa"),
    ("(a*)*", "␣aaa", "b"),
    ("(a|b)*abb", "abb␣aababb", "ab␣abba"),
    ("(a?){3}a{3}", "aaa␣aaaaaa", "aa␣aaaaaaa"),
    ("x{1,1}", "x", "␣xx"),
    ("(a|ab)(c|bcd)", "ac␣abc␣abcd␣abbcd", "ab␣abbc"),
    // Classes.
    ("[abc]", "a␣b␣c", "d␣␣ab"),
    ("[a-c]+", "abc␣cab", "abd"),
    ("[^0-9]", "ä␣x␣𝄞", "7␣"),
    ("[^a-z]*", "␣A1 ", "a"),
    ("[a-]", "a␣-", "b"),
    ("[-a]", "a␣-", "b"),
    ("[+--]", "+␣,␣-", "."),
    ("[a^]", "a␣^", "b"),
    ("[$.*+?(){}|]", "$␣.␣*␣+␣?␣(␣)␣{␣}␣|", "\\␣a"),
    (r"[\-+a\]]*", "+-a]␣", "\\"),
    (r"[\[\]\\\^]", "[␣]␣\\␣^", "a"),
    (r"[\n\t]", "\n␣\t", " "),
    ("[é-ü]", "é␣ü␣î", "e␣à"),
    ("[中-丰]", "中", "上␣a"),
    ("[𝄞-𝄢]", "𝄞␣𝄢", "𝄣"),
    ("[&&a]", "&␣a", "b"),
    ("[a~~b]", "a␣~␣b", "c"),
    ("[!--]", "!␣-␣#", "."),
    ("[a-z0-9_]+", "a_0", "A␣-"),
    (r"[\d\s]+", "1 2", "a"),
    (r"[^\d\s]", "a", "1␣ "),
    (r"[\D]", "a", "1"),
    (r"[^\D]", "1", "a"),
    // Subtraction.
    ("[a-z-[aeiou]]+", "xyz", "xay␣a"),
    ("[a-z-[^aeiou]]", "a␣e", "b"),
    ("[^a-z-[0-9]]", "A␣-", "a␣5"),
    ("[a-z-[b-y-[m]]]", "a␣m␣z", "b␣n"),
    (r"[\i-[:]][\c-[:]]*", "a␣_b-1", "a:b␣1a␣:"),
    (r"[\d-[5]]", "4␣6", "5␣a"),
    ("[a-[a]]", "∅", "a␣b"),
    ("x[a-[a]]?", "x", "xa"),
    ("[ -~-[&<>]]*", "abc \"", "a&b␣<"),
    // Escapes of several characters.
    (".", "a␣𝄞␣\t␣\u{85}␣\u{2028}", "\n␣\r␣␣ab"),
    (".*", "␣anything at all", "a\nb"),
    (r"\s\S", " x␣\tx", "xx␣  "),
    (r"\s", " ␣\t␣\n␣\r", "\u{a0}␣\u{2003}␣\u{b}␣a"),
    (r"\S", "a␣\u{a0}", " ␣\n"),
    (r"\d", "0␣9␣٣␣९␣４␣𝟗␣\u{1E950}", "a␣²␣½␣Ⅷ␣"),
    (r"\D", "a␣²", "0␣𝟗"),
    (r"\d\.\d{2}", "1.25", "1.2␣1.255␣1,25"),
    (r"\i", "a␣_␣:␣é␣中␣\u{10000}", "1␣-␣.␣×␣\u{b7}␣÷"),
    (r"\I", "1␣-␣×␣ ", "a␣_␣:"),
    (r"\c", "a␣1␣-␣.␣\u{b7}␣\u{300}␣\u{2040}", " ␣×␣/␣\u{2041}"),
    (r"\C", " ␣/␣×", "a␣1␣."),
    (r"\i\c*", "_x-1␣a", "1x␣-a␣"),
    (r"\c+", "1.2-3␣a:b", "a b␣"),
    // Escapes of single characters.
    (r"\.\|\?\*\+\(\)\{\}\-\[\]\^\\", r".|?*+(){}-[]^\", "."),
    (r"\n\r\t", "\n\r\t", "nrt"),
    (r"a\-b", "a-b", r"a\-b"),
    // Patterns of the published schemas.
    ("[$][A-Za-z_][A-Za-z0-9_]*", "$a␣$_1", "a␣$␣$1␣$a-b"),
    (
        r"[$][{][ A-Za-z0-9_\+\-\*/%$\(\)\.,]*[\}]",
        "${}␣${1 + $a}␣${max(1,2)}",
        "${a␣${a|b}␣$a}",
    ),
    ("[A-Z]{3}", "DEU", "DE␣deu"),
    // Text, and combinations of everything.
    ("é中𝄞", "é中𝄞", "é中␣e中𝄞"),
    (r"-?([1-9]\d*|0)(\.\d+)?", "0␣-1.5␣10", "01␣1.␣-"),
    (
        r"[A-Z]{1,3}-[A-Z]{1,2} [1-9]\d{0,3}",
        "M-AB 123",
        "M-AB 0123␣MMMM-A 1",
    ),
    (r"(\d{1,3}\.){3}\d{1,3}", "127.0.0.1", "127.0.0␣1270.0.0.1"),
    (r"#[0-9a-fA-F]{6}", "#00ffAA", "#00ffA␣00ffAA"),
    (
        r"\d{4}-\d{2}-\d{2}(Z|[+\-]\d{2}:\d{2})?",
        "2024-05-01␣2024-05-01+02:00",
        "24-5-1",
    ),
    ("(0|1(01*0)*1)*", "0␣11␣110␣1001", "1␣10␣101"),
    // Large, but harmless.
    ("[a-z]{1000}", "∅", "a"),
    ("(()*){1000}", "", "a"),
    (
        "((((((((a?){2}){2}){2}){2}){2}){2}){2})",
        "␣a␣aaaaaaaa",
        "b",
    ),
    (r"\c{50}", "∅", "a"),
];

#[test]
fn patterns_match_what_the_standard_says() {
    let mut count = 0;
    for (source, good, bad) in CASES {
        let pattern = Pattern::new(source).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(pattern.source(), *source);
        for (texts, expected) in [(good, true), (bad, false)] {
            for text in texts.split('␣').filter(|text| *text != "∅") {
                assert_eq!(pattern.matches(text), expected, "{source:?} and {text:?}");
                count += 1;
            }
        }
    }
    assert!(count > 300, "{count}");
    assert!(Pattern::new("[a-z]{1000}").is_ok_and(|it| it.matches(&"k".repeat(1000))));
}

#[test]
fn wrong_patterns_are_refused_with_their_position() {
    for (source, at, said) in [
        ("(", 2, "a group is not closed"),
        ("(a|b", 5, "a group is not closed"),
        (")", 1, "a closing parenthesis without an opening one"),
        ("a)b", 2, "a closing parenthesis without an opening one"),
        ("[", 2, "the pattern ends too early"),
        ("[a", 3, "the pattern ends too early"),
        ("[a-[b]", 7, "a class is not closed"),
        ("[a[b]]", 4, "an opening bracket inside a class"),
        ("[]", 2, "a class without characters"),
        ("[^]", 3, "a class without characters"),
        ("[-[a]]", 2, "a class without characters"),
        ("[z-a]", 5, "a range with its end before its start"),
        (r"[+-\d]", 6, "a range must end with one character"),
        ("]", 2, "a closing bracket without an opening one"),
        ("}", 2, "a closing bracket without an opening one"),
        ("*", 2, "a quantifier with nothing before it"),
        ("a**", 4, "a quantifier with nothing before it"),
        ("a+?", 4, "a quantifier with nothing before it"),
        ("(?:a)", 3, "a quantifier with nothing before it"),
        ("a{3,1}", 7, "a quantifier with a maximum below its minimum"),
        ("a{,2}", 3, "a quantifier needs a number"),
        ("a{x}", 3, "a quantifier needs a number"),
        ("a{2", 4, "the pattern ends too early"),
        ("a{2x}", 5, "a quantifier is not closed"),
        ("a{1001}", 7, "a quantifier greater than 1000"),
        ("a{99999999999}", 14, "a quantifier greater than 1000"),
        (r"\q", 3, "unknown escape sequence"),
        (r"\b", 3, "unknown escape sequence"),
        (r"\1", 3, "unknown escape sequence"),
        ("\\", 2, "the pattern ends too early"),
        (
            r"\p{L}",
            3,
            "Unicode categories (\\p, \\w) are not supported",
        ),
        (
            r"\P{IsBasicLatin}",
            3,
            "Unicode categories (\\p, \\w) are not supported",
        ),
        (
            r"[\w]",
            4,
            "Unicode categories (\\p, \\w) are not supported",
        ),
    ] {
        let error = Pattern::new(source).expect_err(source);
        let expected = PatternError::Syntax {
            pattern: source.to_owned(),
            at,
            what: said,
        };
        assert_eq!(error, expected);
    }
    let deep = "(".repeat(70) + &")".repeat(70);
    assert!(Pattern::new(&deep).is_err_and(|error| error.to_string().contains("too deeply")));
}

#[test]
fn hostile_sizes_are_refused_with_the_limit() {
    for source in [
        "(a|b)*a(a|b){20}",
        "((a{100}){100}){100}",
        "(((((a{1000}){1000}){1000}){1000}){1000}){1000}",
        r"(\c{1000}){1000}",
        r"\i{1000}",
        "(.*a.*b.*c.*d.*e.*f.*g){500}",
        "((a?){1000}){1000}",
    ] {
        let error = Pattern::new(source).expect_err(source);
        assert!(
            matches!(error, PatternError::TooLarge { limit: 4, .. }),
            "{error}"
        );
        assert!(
            error
                .to_string()
                .ends_with("its automaton needs more than 4 MiB"),
            "{error}"
        );
    }
}

fn matches(pattern: &str, text: &str) -> bool {
    Pattern::new(pattern)
        .expect("the pattern is valid")
        .matches(text)
}

#[test]
fn patterns_are_anchored_at_both_ends() {
    assert!(matches("[A-Z]{2}", "DE"));
    assert!(!matches("[A-Z]{2}", "DEU") && !matches("[A-Z]{2}", "xDE") && !matches("[A-Z]{2}", ""));
    assert!(matches("^a$", "^a$") && !matches("^a$", "a"));
}

#[test]
fn quantifiers_and_groups_match() {
    assert!(matches(r"\d\.\d{2}", "1.25") && !matches(r"\d\.\d{2}", "1.2"));
    assert!(
        matches("(ab|c){2,3}", "abc")
            && matches("(ab|c){2,3}", "ccab")
            && !matches("(ab|c){2,3}", "c")
    );
    assert!(matches("a{0}b?", "") && matches("a{2,}", "aaaa") && !matches("a{2,}", "a"));
    assert!(matches("", "") && !matches("", "x") && matches("a||b", ""));
}

#[test]
fn character_classes_subtract_and_negate() {
    assert!(matches("[a-z-[aeiou]]+", "xyz") && !matches("[a-z-[aeiou]]+", "xay"));
    assert!(matches("[^0-9]", "ä") && !matches("[^0-9]", "7"));
    assert!(matches(r"[\-+a\]]*", "+-a]") && matches("[a-]", "-") && matches("[-a]", "-"));
    assert!(matches(r"\i\c*", "_x-1") && !matches(r"\i\c*", "1x"));
    assert!(
        matches(r"\s\S", " x") && matches(r"\D", "x") && matches(".", "𝄞") && !matches(".", "\n")
    );
}

#[test]
fn unsupported_or_explosive_pattern_is_refused() {
    for bad in [
        "(", ")", "[", "[z-a]", "a{3,1}", "*", r"\p{L}", r"\w", r"\q", "a{99999}", "a**", "]", "}",
    ] {
        assert!(Pattern::new(bad).is_err(), "{bad}");
    }
    let explosive = "(a|b)*a(a|b){20}";
    assert!(matches!(
        Pattern::new(explosive),
        Err(PatternError::TooLarge { .. })
    ));
}

//! Tests of combined scenarios and library files, beyond the examples of the pages.

use std::path::PathBuf;

use qcbus_sdk::{Loaded, Plan, examine};

/// Returns the findings of a rule in `main.xosc` among some files: their texts, each with its
/// number of places.
fn found(test: &str, files: &[(&str, String)], rule: &str) -> Vec<(String, usize)> {
    let directory = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(test);
    let _ = std::fs::remove_dir_all(&directory);
    std::fs::create_dir_all(&directory).unwrap();
    for (name, text) in files {
        std::fs::write(directory.join(name), text).unwrap();
    }
    let loaded = Loaded::from_path(&directory.join("main.xosc"), &directory).unwrap();
    let outcome = examine(&Plan::by_default(&qcbus_modular::BUNDLE), &loaded).unwrap();
    let id = format!("check_qcbus_mosc_{rule}");
    let checker = outcome.checkers.iter().find(|checker| *checker.id == *id);
    let issues = &checker.unwrap().issues;
    let said = issues
        .iter()
        .map(|issue| (issue.description.clone(), issue.locations.len()));
    said.collect()
}

fn file(declared: &str, groups: &str) -> String {
    format!(
        r#"<OpenSCENARIO><FileHeader revMajor="1" revMinor="3" date="2026-01-01T00:00:00" description="" author=""/>
        {declared}<Storyboard><Init><Actions/></Init><Story name="S"><Act name="A">{groups}</Act></Story></Storyboard>
        </OpenSCENARIO>"#
    )
}

const ENTITIES: &str = r#"<Entities><ScenarioObject name="Ego"/></Entities>"#;

/// Returns a group that takes a group from another file.
fn taking(name: &str, from: &str, group: &str, keys: &[(&str, &str)]) -> String {
    let keys: String = keys
        .iter()
        .map(|(key, value)| format!(r#"<ParameterReference key="{key}" value="{value}"/>"#))
        .collect();
    format!(
        r#"<ManeuverGroup name="{name}" maximumExecutionCount="1">
        <Actors selectTriggeringEntities="false"><EntityRef entityRef="Ego"/></Actors>
        <ScenarioReference scenarioFileName="{from}"><ManeuverGroupReference maneuverGroupName="{group}">{keys}
        </ManeuverGroupReference></ScenarioReference></ManeuverGroup>"#
    )
}

/// Returns a group that others take, with the content of its only action.
fn offering(name: &str, action: &str) -> String {
    format!(
        r#"<ManeuverGroup name="{name}" maximumExecutionCount="1">
        <Actors selectTriggeringEntities="false"><EntityRef entityRef="Veh"/></Actors>
        <Maneuver name="M"><Event name="E" priority="overwrite"><Action name="D"><PrivateAction>{action}</PrivateAction>
        </Action></Event></Maneuver></ManeuverGroup>"#
    )
}

fn speed(attributes: &str) -> String {
    format!(
        r#"<LongitudinalAction><SpeedAction>
        <SpeedActionDynamics dynamicsShape="step" dynamicsDimension="time" {attributes}/>
        <SpeedActionTarget><AbsoluteTargetSpeed {attributes}/></SpeedActionTarget></SpeedAction></LongitudinalAction>"#
    )
}

#[test]
fn parameter_missing_for_many_values_is_reported_once() {
    let library = file("", &offering("Drive", &speed(r#"value="$v""#)));
    let groups = taking("A", "lib.xosc", "Drive", &[]) + &taking("B", "lib.xosc", "Drive", &[]);
    let files = [
        ("main.xosc", file(ENTITIES, &groups)),
        ("lib.xosc", library),
    ];
    let said = found("parameters", &files, "result_parameters_resolved");
    // The places are the first group that needs the parameter, the value in the library file, and
    // the second group.
    assert_eq!(said.len(), 1, "{said:?}");
    assert_eq!(said[0].1, 3, "{said:?}");
}

#[test]
fn story_declaration_resolves_parameter_of_group() {
    let library = file("", &offering("Drive", &speed(r#"value="$v""#)));
    let main = file(ENTITIES, &taking("A", "lib.xosc", "Drive", &[])).replace(
        r#"<Story name="S">"#,
        r#"<Story name="S"><ParameterDeclarations><ParameterDeclaration name="v" parameterType="double" value="1"/>
        </ParameterDeclarations>"#,
    );
    let files = [("main.xosc", main), ("lib.xosc", library)];
    assert_eq!(found("story", &files, "result_parameters_resolved"), []);
}

#[test]
fn dollar_text_that_is_no_parameter_is_ignored() {
    for value in ["$$", "$(find-pkg-share x)", "5$", "$"] {
        let library = file(
            "",
            &offering("Drive", &speed(&format!(r#"value="{value}""#))),
        );
        let main = file(ENTITIES, &taking("A", "lib.xosc", "Drive", &[]));
        let files = [("main.xosc", main), ("lib.xosc", library)];
        assert_eq!(found("dollar", &files, "result_parameters_resolved"), []);
    }
}

#[test]
fn entity_named_by_parameter_is_resolved() {
    let action = |name: &str| {
        format!(
            r#"<SynchronizeAction masterEntityRef="{name}" parameterAttributes="masterEntityRef"/>"#
        )
    };
    let declared = |value: &str| {
        format!(
            r#"<ParameterDeclarations><ParameterDeclaration name="who" parameterType="string" value="{value}"/>
            </ParameterDeclarations>{ENTITIES}"#
        )
    };
    let library = || file("", &offering("Drive", &action("$who")));
    let group = taking("A", "lib.xosc", "Drive", &[]);
    for (value, count) in [("Ego", 0), ("Nobody", 1)] {
        let main = file(&declared(value), &group);
        let files = [("main.xosc", main), ("lib.xosc", library())];
        let said = found("entities", &files, "result_entities_declared");
        assert_eq!(said.len(), count, "{said:?}");
    }
    let undeclared = [
        ("main.xosc", file(ENTITIES, &group)),
        ("lib.xosc", library()),
    ];
    assert_eq!(found("nobody", &undeclared, "result_entities_declared"), []);
}

#[test]
fn inner_scenario_values_are_checked_where_written() {
    let library = || {
        let offers = speed(r#"value="0" parameterAttributes="value""#);
        file("", &offering("Drive", &offers))
    };
    let inner = file(
        "",
        &taking("Inner", "lib.xosc", "Drive", &[("value", "-1")]),
    );
    let outer = |keys: &[(&str, &str)]| {
        let group = taking("Outer", "inner.xosc", "Inner.Drive", keys);
        file(ENTITIES, &group)
    };
    let files = |main: String| {
        [
            ("main.xosc", main),
            ("inner.xosc", inner.clone()),
            ("lib.xosc", library()),
        ]
    };
    let said = found("inner", &files(outer(&[])), "value_range");
    assert_eq!(said.len(), 2, "{said:?}");
    // A value that an outer scenario replaces is not reported.
    let said = found("outer", &files(outer(&[("value", "1")])), "value_range");
    assert_eq!(said, []);
    // Nesting creates dots in names, and these are allowed.
    let said = found("dots", &files(outer(&[])), "library_name_with_dot");
    assert_eq!(said, []);
}

#[test]
fn unreadable_catalog_location_hides_unresolved_reference() {
    let route = r#"<RoutingAction><AssignRouteAction><CatalogReference catalogName="r" entryName="e"/>
        </AssignRouteAction></RoutingAction>"#;
    let library = || file("", &offering("Drive", route));
    let group = taking("A", "lib.xosc", "Drive", &[]);
    let located = r#"<CatalogLocations><RouteCatalog><Directory path="gone"/></RouteCatalog></CatalogLocations>"#;
    for (declared, count) in [("", 1), (located, 0)] {
        let main = file(&format!("{declared}{ENTITIES}"), &group);
        let files = [("main.xosc", main), ("lib.xosc", library())];
        let said = found("catalogs", &files, "result_catalogs_resolve");
        assert_eq!(said.len(), count, "{said:?}");
    }
}

#[test]
fn missing_group_does_not_hide_findings_of_others() {
    let offers = speed(r#"value="0" parameterAttributes="value""#);
    let library = file("", &offering("Drive", &offers));
    let groups = taking("A", "gone.xosc", "Drive", &[])
        + &taking(
            "B",
            "lib.xosc",
            "Drive",
            &[("AbsoluteTargetSpeed.value", "x")],
        );
    let files = [
        ("main.xosc", file(ENTITIES, &groups)),
        ("lib.xosc", library),
    ];
    assert_eq!(found("other", &files, "value_type").len(), 1);
}

/// Returns a scenario with this number of groups that take a library group.
fn often(count: usize, from: &str, keys: &[(&str, &str)]) -> String {
    let groups = (0..count).map(|index| taking(&format!("G{index}"), from, "Drive", keys));
    file(ENTITIES, &groups.collect::<String>())
}

#[test]
fn library_fault_is_reported_once_for_all_references() {
    let good = || offering("Drive", &speed(r#"value="0" parameterAttributes="value""#));
    let nobody = good().replace(r#"<EntityRef entityRef="Veh"/>"#, "");
    let two = good().replace("</Actors>", r#"<EntityRef entityRef="Veh2"/></Actors>"#);
    let nameless = good().replace(r#"name="Drive" "#, "") + &good();
    let inner = taking("Drive", "gone.xosc", "X", &[]);
    let lists = offering(
        "Drive",
        &speed(r#"value="0" parameterAttributes="value,a,b""#),
    );
    let nothing = offering("Drive", &speed(r#"value="0""#));
    for (test, library, rule, texts) in [
        ("nobody", file("", &nobody), "actor_entity_ref", 1),
        ("two", file("", &two), "actor_entity_ref", 1),
        (
            "twice",
            file("", &(good() + &good())),
            "reference_maneuver_group_known",
            1,
        ),
        (
            "nameless",
            file("", &nameless),
            "reference_maneuver_group_known",
            1,
        ),
        (
            "broken",
            "<OpenSCENARIO>".to_owned(),
            "reference_file_found",
            1,
        ),
        ("empty", String::new(), "reference_file_found", 1),
        ("map", "<OpenDRIVE/>".to_owned(), "reference_file_found", 1),
        ("inner", file("", &inner), "reference_unexpanded", 1),
        // Each of the two elements with a list has one finding.
        ("lists", file("", &lists), "key_path_exact", 2),
        (
            "nothing",
            file("", &nothing),
            "library_parameter_attributes_missing",
            1,
        ),
    ] {
        for count in [1, 3, 9] {
            let main = often(count, "lib.xosc", &[("AbsoluteTargetSpeed.value", "1")]);
            let files = [("main.xosc", main), ("lib.xosc", library.clone())];
            let said = found(&format!("once_{test}_{count}"), &files, rule);
            assert_eq!(said.len(), texts, "{test}: {said:?}");
            let besides = usize::from(test == "nothing");
            let places = 2 + besides + (count - 1).min(5);
            assert!(
                said.iter().all(|(_, all)| *all == places),
                "{test}: {said:?}"
            );
        }
    }
}

#[test]
fn reference_cycle_is_reported_once() {
    let back = |from: &str| taking("Drive", from, "Drive", &[]) + &taking("B", from, "Drive", &[]);
    let files = [
        ("main.xosc", file(ENTITIES, &back("lib.xosc"))),
        ("lib.xosc", file("", &back("main.xosc"))),
    ];
    let said = found("circle", &files, "reference_cycle");
    assert_eq!(said.len(), 1, "{said:?}");
    assert_eq!(said[0].1, 3, "{said:?}");
    let files = [("main.xosc", file(ENTITIES, &back("main.xosc")))];
    assert_eq!(found("circle_of_one", &files, "reference_cycle").len(), 1);
}

#[test]
fn two_values_for_same_key_are_ambiguous_and_duplicate() {
    let offers = speed(r#"value="0" parameterAttributes="value""#);
    let key = "AbsoluteTargetSpeed.value";
    let main = often(1, "lib.xosc", &[(key, "1"), (key, "2")]);
    let files = [
        ("main.xosc", main),
        ("lib.xosc", file("", &offering("Drive", &offers))),
    ];
    let tie = found("tie", &files, "key_ambiguous");
    assert!(
        tie.len() == 1 && tie[0].0.contains("can have only one value"),
        "{tie:?}"
    );
    let twice = found("tie", &files, "key_duplicate");
    assert!(
        twice.len() == 1 && twice[0].0.contains("takes the later value, `2`"),
        "{twice:?}"
    );
    assert_eq!(found("tie", &files, "library_default_kept"), []);
}

#[test]
fn key_for_unlisted_attribute_is_reported_with_reason() {
    let action = r#"<TeleportAction><Position><WorldPosition x="0" y="0" parameterAttributes="x"/></Position>
        </TeleportAction>"#;
    for (key, text) in [
        (
            "WorldPosition.y",
            "does not list it in `parameterAttributes`, only `x`",
        ),
        (
            "Event.priority",
            "`Event` has the attribute `priority` but does not list it in `parameterAttributes`:",
        ),
        (
            "ManeuverGroup.name",
            "attributes of the `ManeuverGroup` itself are never replaced",
        ),
        ("WorldPosition.X", "did you mean `WorldPosition.x`?"),
        (" ", "`key` is empty"),
    ] {
        let files = [
            ("main.xosc", often(1, "lib.xosc", &[(key, "1")])),
            ("lib.xosc", file("", &offering("Drive", action))),
        ];
        let said = found("unoffered", &files, "key_matches");
        assert!(said.len() == 1 && said[0].0.contains(text), "{said:?}");
        assert_eq!(
            said[0].0.contains("did you mean"),
            key.ends_with('X'),
            "{said:?}"
        );
        let missing = found("unoffered", &files, "library_parameter_attributes_missing");
        assert_eq!(missing, []);
    }
}

#[test]
fn malformed_parameter_attribute_list_is_reported_as_such() {
    let action = r#"<TeleportAction><Position><WorldPosition x="0" y="0" parameterAttributes=" x ; y"/></Position>
        </TeleportAction>"#;
    let files = [
        (
            "main.xosc",
            often(1, "lib.xosc", &[("WorldPosition.x", "1")]),
        ),
        ("lib.xosc", file("", &offering("Drive", action))),
    ];
    let said = found("misread", &files, "key_matches");
    let text =
        "lists `x` in `parameterAttributes`, but not as a single name between commas: `x ; y`";
    assert!(said.len() == 1 && said[0].0.ends_with(text), "{said:?}");
}

#[test]
fn less_than_sign_in_cdata_is_not_reported() {
    let script = |text: &str| {
        let action = format!(
            "<UserDefinedAction><CustomCommandAction type='t'>{text}</CustomCommandAction></UserDefinedAction>"
        );
        file("", &offering("Drive", &action))
    };
    for (text, count) in [
        ("<![CDATA[a < b]]>", 0),
        ("<![CDATA[a < b]]> and b &#x3C; c", 1),
        ("a &lt; b", 1),
        ("a &gt; b &amp;lt; c", 0),
    ] {
        let main = file(ENTITIES, &taking("A", "lib.xosc", "Drive", &[]));
        let files = [("main.xosc", main), ("lib.xosc", script(text))];
        let said = found("cdata", &files, "text_lt_in_values");
        assert_eq!(said.len(), count, "{text}: {said:?}");
    }
}

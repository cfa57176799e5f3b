//! Test of the zoo's program. Because of this test the program is built with the tests of the
//! workspace, where all other tests find it.

use std::process::Command;

#[test]
fn unknown_animal_is_refused_with_the_known_names() {
    let zoo = env!("CARGO_BIN_EXE_zoo");
    let output = Command::new(zoo).arg("unicorn").output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    let told = String::from_utf8(output.stderr).unwrap();
    assert!(told.contains("no animal is called `unicorn`"), "{told}");
    for animal in qcbus_zoo::animals::ANIMALS {
        assert!(told.contains(animal.name), "{} must be listed", animal.name);
    }
}

//! Test of the zoo's program. Because of this test the program is built with the tests of the
//! workspace, where all other tests find it.

use std::process::Command;

#[test]
fn who_asks_for_no_animal_that_there_is_reads_which_there_are() {
    let zoo = env!("CARGO_BIN_EXE_zoo");
    let output = Command::new(zoo).arg("unicorn").output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    let told = String::from_utf8(output.stderr).unwrap();
    assert!(told.contains("no animal is called `unicorn`"), "{told}");
    for animal in qcbus_zoo::animals::ANIMALS {
        assert!(told.contains(animal.name), "{} is not told", animal.name);
    }
}

//! Parsing of the arguments, without a library.

use std::path::PathBuf;
use std::time::Duration;

/// Usage text of the zoo.
pub const USAGE: &str = "\
usage: zoo ANIMAL [--name NAME] [--version TEXT] [--millis N]
           [--instance NAME | --instance-dir DIR] [--launch N] [--die-with-parent]";

/// Arguments of the zoo.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Args {
    /// Name of the animal.
    pub animal: String,
    /// Name on the bus, if it differs from the animal's own.
    pub name: Option<String>,
    /// Version that it claims.
    pub version: String,
    /// Time that it takes for a job.
    pub takes: Option<Duration>,
    /// Instance by name.
    pub instance: String,
    /// Instance by directory.
    pub instance_dir: Option<PathBuf>,
    /// Number of the launch, from the broker that started it.
    pub launch: Option<u64>,
    /// Whether it dies with its parent.
    pub die_with_parent: bool,
}

impl Args {
    /// Parses the arguments after the program's name.
    ///
    /// # Errors
    /// Returns a readable message about the argument that does not fit.
    pub fn parse(mut arguments: impl Iterator<Item = String>) -> Result<Args, String> {
        let mut args = Args {
            animal: String::new(),
            name: None,
            version: "1.0.0".to_owned(),
            takes: None,
            instance: "default".to_owned(),
            instance_dir: None,
            launch: None,
            die_with_parent: false,
        };
        while let Some(argument) = arguments.next() {
            let mut value = || {
                let missing = || format!("`{argument}` needs a value");
                arguments.next().ok_or_else(missing)
            };
            match argument.as_str() {
                "--name" => args.name = Some(value()?),
                "--version" => args.version = value()?,
                "--millis" => args.takes = Some(Duration::from_millis(number(&value()?)?)),
                "--instance" => args.instance = value()?,
                "--instance-dir" => args.instance_dir = Some(PathBuf::from(value()?)),
                "--launch" => args.launch = Some(number(&value()?)?),
                "--die-with-parent" => args.die_with_parent = true,
                animal if args.animal.is_empty() && !animal.starts_with('-') => {
                    args.animal = animal.to_owned();
                }
                other => return Err(format!("`{other}` means nothing here")),
            }
        }
        if args.animal.is_empty() {
            return Err("which animal?".to_owned());
        }
        Ok(args)
    }
}

fn number(text: &str) -> Result<u64, String> {
    text.parse()
        .map_err(|_| format!("`{text}` is not a number"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(arguments: &[&str]) -> Result<Args, String> {
        Args::parse(arguments.iter().map(|it| (*it).to_owned()))
    }

    #[test]
    fn arguments_of_an_animal_are_parsed() {
        let args = of(&[
            "slow",
            "--millis",
            "20",
            "--instance-dir",
            "/i",
            "--launch",
            "7",
        ])
        .unwrap();
        assert_eq!(args.animal, "slow");
        assert_eq!(args.takes, Some(Duration::from_millis(20)));
        assert_eq!(args.instance_dir, Some(PathBuf::from("/i")));
        assert_eq!(args.launch, Some(7));
    }

    #[test]
    fn invalid_arguments_are_refused() {
        for wrong in [
            &[][..],
            &["slow", "--millis"],
            &["slow", "--launch", "x"],
            &["a", "b"],
        ] {
            assert!(of(wrong).is_err(), "{wrong:?}");
        }
    }
}

//! Model of the schema rule: the result of validating the root, and the user's schemas.

use std::sync::Arc;

use qcbus_schema::{
    Checked, Options, Outcome, Override, SkipReason, UserSchemaContent, UserSchemaFile,
};
use qcbus_sdk::{Model, Param, Resource, ResourceFile, ResourceValue, Subject, Unbuilt};

/// Marker of rules for the validated document. They report nothing if no schema applies.
#[derive(Debug)]
pub struct Validated;

impl Model for Validated {
    type Of<'d> = Checked<'d>;
    type Part = ();

    fn build<'d>(subject: &'d Subject<'d>) -> Result<Checked<'d>, Unbuilt> {
        match qcbus_schema::check(&subject.root(), subject.kind(), &options(subject)) {
            Outcome::Checked(checked) => Ok(checked),
            Outcome::Skipped(reason) => Err(unbuilt(&reason)),
        }
    }

    fn parts(_: &Checked<'_>) -> Vec<()> {
        vec![()]
    }
}

/// Returns the options. The user's schemas have priority over those that come with qcbus.
pub(crate) fn options(subject: &Subject<'_>) -> Options {
    let own = subject.resource::<Overrides>();
    Options {
        overrides: own.map(|it| it.0.clone()).unwrap_or_default(),
        ..Options::default()
    }
}

/// Converts the reason for a skipped validation. Old versions have no schema, so the rule does not
/// apply to them. A file without a version or with ill-formed XML is broken. Other rules report
/// this too, but the file is not accepted here.
fn unbuilt(reason: &SkipReason) -> Unbuilt {
    let text = reason.to_string();
    match reason {
        SkipReason::MajorZero(_) | SkipReason::NoSchema(_) => Unbuilt::NotApplicable(text),
        SkipReason::NoVersion | SkipReason::IllFormed => Unbuilt::Broken(text),
        SkipReason::Tables(_) => Unbuilt::Failed(text),
    }
}

/// Directory of the user's schemas.
pub(crate) const SCHEMA_DIR: Param = Param::text(
    "schemaDir",
    "",
    "directory with schemas (.xsd, .tbl) to use instead of those shipped with qcbus",
);

/// The user's schemas. They are read and compiled before the first check.
pub(crate) static SCHEMAS: Resource = Resource {
    param: SCHEMA_DIR,
    endings: &["xsd", "tbl"],
    make: compiled,
};

/// The user's schemas. Those for one version come first.
struct Overrides(Vec<Override>);

fn compiled(files: &[ResourceFile]) -> Result<ResourceValue, String> {
    let read = |file: &ResourceFile| {
        let image = (!file.ends_in("tbl")).then(|| file.image());
        let path = file.path().display().to_string();
        (path, file.below(), file.digest().to_string(), image)
    };
    let read: Vec<_> = files.iter().map(read).collect();
    let own: Vec<UserSchemaFile<'_>> = read
        .iter()
        .zip(files)
        .map(|((path, below, sha256, image), file)| UserSchemaFile {
            path,
            below,
            sha256,
            content: match image {
                Some(image) => UserSchemaContent::Xsd(image),
                None => UserSchemaContent::Tables(file.bytes()),
            },
        })
        .collect();
    let overrides = qcbus_schema::user_schemas(&own).map_err(|error| error.to_string())?;
    Ok(Arc::new(Overrides(overrides)))
}

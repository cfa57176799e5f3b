//! A rule: its data and its check function.

use std::any::{Any, TypeId};

use qcbus_document::Document;
use qcbus_formats::pool::Ending;
use qcbus_formats::xqar::Level;

use crate::{Param, Resource, Sink, Subject};

/// The model that a rule checks. It is built once per document and shared by all rules about it.
///
/// The type that implements the trait is only a name. Rules get a value of [`Model::Of`].
pub trait Model: 'static {
    /// The model of a document that lives for `'d`. Threads share it, so it caches lazily computed
    /// values in `OnceLock`s.
    type Of<'d>: Sync;

    /// A part of the model. Several rules check one part in turn before they go on to the next. A
    /// part is small enough to stay in the processor's caches meanwhile.
    type Part: Sync;

    /// Builds the model. It should be lazy, because most documents need little of it.
    ///
    /// # Errors
    /// [`Unbuilt`] if rules about this model cannot check the document.
    fn build<'d>(subject: &'d Subject<'d>) -> Result<Self::Of<'d>, Unbuilt>;

    /// Returns the parts of a model, in document order.
    fn parts(model: &Self::Of<'_>) -> Vec<Self::Part>;
}

/// Reason why a model was not built, as a sentence fragment:
/// `the road network could not be loaded`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Unbuilt {
    /// Rules about the model do not apply to such a document. This is a valid answer.
    NotApplicable(String),
    /// The document is broken. Its rules cannot give an answer, and the file is not accepted.
    Broken(String),
    /// An input of the model is unusable. The document itself may be valid.
    Failed(String),
}

impl From<Unbuilt> for Ending {
    fn from(unbuilt: Unbuilt) -> Ending {
        match unbuilt {
            Unbuilt::NotApplicable(reason) => Ending::NotApplicable { reason },
            Unbuilt::Broken(reason) => Ending::Blocked {
                by: Vec::new(),
                reason,
            },
            Unbuilt::Failed(reason) => Ending::Failed { reason },
        }
    }
}

/// The document itself, for rules that need no other model: `Rule<Document>`.
impl Model for Document<'static> {
    type Of<'d> = Document<'d>;
    type Part = ();

    fn build<'d>(subject: &'d Subject<'d>) -> Result<Document<'d>, Unbuilt> {
        Ok(subject.root())
    }

    fn parts(_: &Document<'_>) -> Vec<()> {
        vec![()]
    }
}

/// A rule: its name, the conditions under which it applies, and the check function.
///
/// ```text
/// pub const RULE: Rule<Document> = Rule {
///     level: Level::Warning,
///     run,
///     ..Rule::after(&["check_asam_xodr_xml_root_tag_is_opendrive"])
/// };
/// ```
///
/// [`rules!`](crate::rules) fills in `id`, `page` and a single UID.
pub struct Rule<M: Model> {
    /// Identifier of the checker, unique in the bundle. It ends in the name of the rule's file.
    pub id: &'static str,
    /// Rules of the standard that it covers. Issues have the first UID, unless a finding names
    /// another.
    pub uids: &'static [&'static str],
    /// Severity of its issues, unless a finding sets another. [`Level::Error`] by default.
    pub level: Level,
    /// What readers do with files that violate it, if it differs from `level`, which is that of the
    /// standard.
    pub readers: Option<Readers>,
    /// Versions of the standard that it applies to; see [`crate::VersionRange`].
    pub versions: &'static str,
    /// Whether older documents are checked, too.
    pub backport: Backport,
    /// Checkers that must have completed without an error. Otherwise this checker cannot run, and
    /// the file is not accepted.
    pub after: &'static [&'static str],
    /// Parameters that it reads.
    pub params: &'static [Param],
    /// User files that the rule needs. They are read before it runs.
    pub resource: Option<&'static Resource>,
    /// Whether it runs if no configuration selects it. `true` by default.
    pub default_on: bool,
    /// Documentation page: `include_str!` of the Markdown file beside the rule.
    pub page: &'static str,
    /// Checks one part of the document after the other and reports findings. It is for rules that
    /// can check each part on its own.
    pub each: Option<Each<M>>,
    /// Checks the document and reports findings, after `each` has checked all parts. Does nothing
    /// by default.
    pub run: fn(&M::Of<'_>, &mut Sink<'_>),
}

/// Checks one part of a model and reports its findings.
pub type Each<M> = fn(&<M as Model>::Of<'_>, &<M as Model>::Part, &mut Sink<'_>);

/// Treatment of documents of versions before the range of the rule.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Backport {
    /// The rule is skipped.
    None,
    /// The rule runs. Its issues are one severity lower and state that the rule is not normative
    /// there.
    Lower {
        /// First version that has the relevant elements; empty for every version.
        since: &'static str,
    },
    /// Like `Lower`, but as a separate checker, `…_backport`. So the gate of this checker stays
    /// comparable with other tools.
    Separate {
        /// First version that has the relevant elements; empty for every version.
        since: &'static str,
    },
    /// A separate checker, `…_backport`, with the same severity. Its findings broke older
    /// documents, too, although the rule was not yet written down.
    Alike {
        /// First version that has the relevant elements; empty for every version.
        since: &'static str,
    },
}

impl Backport {
    /// Returns whether older documents have a separate checker.
    pub(crate) fn is_separate(self) -> bool {
        matches!(self, Backport::Separate { .. } | Backport::Alike { .. })
    }
}

impl<M: Model> Rule<M> {
    /// Default values of a rule, for its `..`. The page test fails if a rule has no id, UIDs, page
    /// or function.
    pub const DEFAULTS: Rule<M> = Rule {
        id: "",
        uids: &[],
        level: Level::Error,
        readers: None,
        versions: "",
        backport: Backport::None,
        after: &[],
        params: &[],
        resource: None,
        default_on: true,
        page: "",
        each: None,
        run: finds_nothing::<M>,
    };

    /// Returns the default values of a rule with these preconditions, for its `..`.
    pub const fn after(checkers: &'static [&'static str]) -> Rule<M> {
        Rule {
            after: checkers,
            ..Rule::DEFAULTS
        }
    }
}

/// Lists the rules of a bundle. Each line has a prefix of the id, the name of a module with a
/// `RULE`, and the UID. A rule with several UIDs has the field `uids` instead.
///
/// ```text
/// mod xml_fileheader_is_present;
///
/// pub static RULES: &[&dyn AnyRule] = qcbus_sdk::rules! {
///     asam_xodr xml_fileheader_is_present "asam.net:xodr:1.0.0:xml.fileheader_is_present",
/// };
/// ```
///
/// The id of this rule is `check_asam_xodr_xml_fileheader_is_present`. Its page is the file
/// `xml_fileheader_is_present.md` beside the list. The `mod` lines are outside of the macro, because
/// `cargo fmt` does not look for files within macros.
#[macro_export]
macro_rules! rules {
    ($($prefix:ident $name:ident $($uid:literal)?,)*) => {
        &[$(&$crate::Rule {
            id: concat!("check_", stringify!($prefix), "_", stringify!($name)),
            $(uids: {
                assert!($name::RULE.uids.is_empty(), "the rule has the field `uids`; list it without a UID");
                &[$uid]
            },)?
            page: include_str!(concat!(stringify!($name), ".md")),
            ..$name::RULE
        }),*]
    };
}

fn finds_nothing<M: Model>(_: &M::Of<'_>, _: &mut Sink<'_>) {}

/// A built model, on which every rule of its kind can run.
#[doc(hidden)]
pub trait Built<'d>: Sync {
    /// Returns the number of parts of the model.
    fn parts(&self) -> usize;
    /// Runs a rule on one part.
    fn each(&self, part: usize, rule: &dyn AnyRule, found: &mut Sink<'d>);
    /// Runs a rule on the whole model.
    fn run(&self, rule: &dyn AnyRule, found: &mut Sink<'d>);
}

struct Divided<'m, 'd, M: Model> {
    whole: &'m M::Of<'d>,
    parts: Vec<M::Part>,
}

impl<'d, M: Model> Built<'d> for Divided<'_, 'd, M> {
    fn parts(&self) -> usize {
        self.parts.len()
    }

    fn each(&self, part: usize, rule: &dyn AnyRule, found: &mut Sink<'d>) {
        let rule = rule.as_any().downcast_ref::<Rule<M>>();
        if let (Some(each), Some(part)) = (rule.and_then(|rule| rule.each), self.parts.get(part)) {
            each(self.whole, part, found);
        }
    }

    fn run(&self, rule: &dyn AnyRule, found: &mut Sink<'d>) {
        if let Some(rule) = rule.as_any().downcast_ref::<Rule<M>>() {
            (rule.run)(self.whole, found);
        }
    }
}

/// A rule of any model, as a bundle lists it.
pub trait AnyRule: Sync {
    /// Returns everything about the rule except its function.
    fn facts(&self) -> Facts;
    /// Returns the type id of the rule's model.
    fn model(&self) -> TypeId;
    /// Returns whether the rule checks one part of the model after the other.
    fn goes_by_parts(&self) -> bool;
    /// Builds this rule's model and passes it on, for every rule of the same model.
    #[doc(hidden)]
    fn with_model<'d>(
        &self,
        subject: &'d Subject<'d>,
        permit: &mut dyn FnMut(&dyn Built<'d>),
    ) -> Result<(), Unbuilt>;
    /// Returns the rule as `Any`, so that its type can be determined.
    #[doc(hidden)]
    fn as_any(&self) -> &dyn Any;
}

/// Level of a rule by what simulators do with a file that violates it, and the reason.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Readers {
    /// Level of findings that set no other level.
    pub level: Level,
    /// The reason: what readers do. `docs/levels.md` shows it.
    pub because: &'static str,
}

impl Readers {
    /// All known readers pass over violations.
    pub const fn warning(because: &'static str) -> Readers {
        Readers {
            level: Level::Warning,
            because,
        }
    }

    /// Readers suffer from some violations and pass over others, for which the rule sets
    /// [`crate::Finding::readers_level`].
    pub const fn by_case(because: &'static str) -> Readers {
        Readers {
            level: Level::Error,
            because,
        }
    }

    /// Returns the word for its level: `by case` if findings differ.
    pub fn in_a_word(&self) -> &'static str {
        match self.level {
            Level::Error => "by case",
            level => level.as_str(),
        }
    }
}

/// Everything about a rule except its function and its model; see [`Rule`] for the fields.
#[expect(missing_docs, reason = "the fields are those of `Rule`")]
#[derive(Debug, Clone, Copy)]
pub struct Facts {
    pub id: &'static str,
    pub uids: &'static [&'static str],
    pub level: Level,
    pub readers: Option<Readers>,
    pub versions: &'static str,
    pub backport: Backport,
    pub after: &'static [&'static str],
    pub params: &'static [Param],
    pub resource: Option<&'static Resource>,
    pub default_on: bool,
    pub page: &'static str,
}

impl<M: Model> AnyRule for Rule<M> {
    fn facts(&self) -> Facts {
        Facts {
            id: self.id,
            uids: self.uids,
            level: self.level,
            readers: self.readers,
            versions: self.versions,
            backport: self.backport,
            after: self.after,
            params: self.params,
            resource: self.resource,
            default_on: self.default_on,
            page: self.page,
        }
    }

    fn model(&self) -> TypeId {
        TypeId::of::<M>()
    }

    fn goes_by_parts(&self) -> bool {
        self.each.is_some()
    }

    fn with_model<'d>(
        &self,
        subject: &'d Subject<'d>,
        permit: &mut dyn FnMut(&dyn Built<'d>),
    ) -> Result<(), Unbuilt> {
        let whole = &M::build(subject)?;
        let parts = M::parts(whole);
        permit(&Divided::<M> { whole, parts });
        Ok(())
    }

    fn as_any(&self) -> &dyn Any {
        self
    }
}

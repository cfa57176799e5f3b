//! A rule: data and one function.

use std::any::{Any, TypeId};

use qcbus_document::Document;
use qcbus_formats::pool::Ending;
use qcbus_formats::xqar::Level;

use crate::{Param, Resource, Sink, Subject};

/// What a rule looks at: built once per document and shared by all rules about it.
///
/// The type that implements it is only a name; the value that rules get is [`Model::Of`].
pub trait Model: 'static {
    /// The model of a document that lives for `'d`.
    /// Threads share it: what it finds out when it is first asked is behind `OnceLock`s.
    type Of<'d>: Sync;

    /// Names a part of the model at which several rules look in turn before they go on to the next
    /// part: small enough to stay in the processor's caches meanwhile.
    type Part: Sync;

    /// Builds the model. It should be lazy: most documents need little of it.
    ///
    /// # Errors
    /// [`Unbuilt`] when rules about this model cannot say anything about the document.
    fn build<'d>(subject: &'d Subject<'d>) -> Result<Self::Of<'d>, Unbuilt>;

    /// The parts of a model, in document order.
    fn parts(model: &Self::Of<'_>) -> Vec<Self::Part>;
}

/// Why there is no model, each with a sentence fragment: `the road network could not be loaded`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Unbuilt {
    /// Rules about it do not apply to such a document: that is an answer.
    NotApplicable(String),
    /// The document is broken: its rules owe an answer, and the file is not accepted.
    Broken(String),
    /// What the model is built with is of no use; the document may be all right.
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

/// The document itself, for rules that need no more: `Rule<Document>`.
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

/// A rule: what it is called, when it applies, and the function that looks.
///
/// ```text
/// pub static RULE: Rule<Document> = Rule {
///     id: "check_asam_xodr_xml_fileheader_is_present",
///     uids: &["asam.net:xodr:1.0.0:xml.fileheader_is_present"],
///     after: &["check_asam_xodr_xml_root_tag_is_opendrive"],
///     page: include_str!("xml_fileheader_is_present.md"),
///     run,
///     ..Rule::DEFAULTS
/// };
/// ```
pub struct Rule<M: Model> {
    /// Identifier of the checker, unique in the bundle; ends in the name of the rule's file.
    pub id: &'static str,
    /// The rules of the standard that it answers for. The first is printed on issues, unless a
    /// finding says otherwise.
    pub uids: &'static [&'static str],
    /// Severity of its issues, unless a finding says otherwise. [`Level::Error`] by default.
    pub level: Level,
    /// The versions of the standard that it applies to; see [`crate::VersionRange`].
    pub versions: &'static str,
    /// Whether older documents are looked at, too.
    pub backport: Backport,
    /// Checkers that must have run without finding an error; else this one cannot look, and the file is not
    /// accepted.
    pub after: &'static [&'static str],
    /// Parameters that it reads.
    pub params: &'static [Param],
    /// Files of the user that it takes, read before it runs.
    pub resource: Option<&'static Resource>,
    /// Whether it runs when no configuration asks for it. `true` by default.
    pub default_on: bool,
    /// Its page: `include_str!` of the Markdown file beside it.
    pub page: &'static str,
    /// Looks at a part of the document and says what it found, one part after the other: for
    /// rules that need to know nothing of one part to judge the next.
    pub each: Option<Each<M>>,
    /// Looks at the document and says what it found, after `each` has seen all parts. Nothing by default.
    pub run: fn(&M::Of<'_>, &mut Sink<'_>),
}

/// Looks at a part of a model and says what it found there.
pub type Each<M> = fn(&<M as Model>::Of<'_>, &<M as Model>::Part, &mut Sink<'_>);

/// What a rule does with documents of versions before its range.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Backport {
    /// It is skipped.
    None,
    /// It runs, its issues are one severity lower and say that the rule is not normative there.
    Lower {
        /// First version that has the elements in question; empty for every version.
        since: &'static str,
    },
    /// Like `Lower`, but as a checker of its own, `…_backport`, so that the gate of this one
    /// stays comparable with other tools.
    Separate {
        /// First version that has the elements in question; empty for every version.
        since: &'static str,
    },
    /// A checker of its own, `…_backport`, and as severe: what it finds broke older documents just
    /// as well, only that nobody had written the rule down.
    Alike {
        /// First version that has the elements in question; empty for every version.
        since: &'static str,
    },
}

impl Backport {
    /// Whether older documents have a checker of their own.
    pub(crate) fn is_separate(self) -> bool {
        matches!(self, Backport::Separate { .. } | Backport::Alike { .. })
    }
}

impl<M: Model> Rule<M> {
    /// What most rules have in common, for the `..` of a rule. A rule that forgets its id, UIDs,
    /// page or function fails its page test.
    pub const DEFAULTS: Rule<M> = Rule {
        id: "",
        uids: &[],
        level: Level::Error,
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
}

fn finds_nothing<M: Model>(_: &M::Of<'_>, _: &mut Sink<'_>) {}

/// A model that was built, on which every rule of its kind can be run.
#[doc(hidden)]
pub trait Built<'d>: Sync {
    /// How many parts the model has.
    fn parts(&self) -> usize;
    /// Has a rule look at one part.
    fn each(&self, part: usize, rule: &dyn AnyRule, found: &mut Sink<'d>);
    /// Has a rule look at the whole.
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

/// A rule of whatever model, as a bundle lists them.
pub trait AnyRule: Sync {
    /// Everything about the rule but its function.
    fn facts(&self) -> Facts;
    /// Tells apart the models that rules look at.
    fn model(&self) -> TypeId;
    /// Whether it looks at one part of the model after the other.
    fn goes_by_parts(&self) -> bool;
    /// Builds this rule's model and hands it on, for every rule of the same model.
    #[doc(hidden)]
    fn with_model<'d>(
        &self,
        subject: &'d Subject<'d>,
        permit: &mut dyn FnMut(&dyn Built<'d>),
    ) -> Result<(), Unbuilt>;
    /// The rule, to find out its type.
    #[doc(hidden)]
    fn as_any(&self) -> &dyn Any;
}

/// Everything about a rule but its function and its model; see [`Rule`] for the fields.
#[expect(missing_docs, reason = "the fields are those of `Rule`")]
#[derive(Debug, Clone, Copy)]
pub struct Facts {
    pub id: &'static str,
    pub uids: &'static [&'static str],
    pub level: Level,
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

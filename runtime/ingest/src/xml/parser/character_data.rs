//! Handles runs of text, references and CDATA sections between two tags.

use qcbus_document::FaultCode;

use super::{File, Parser, Stop, narrow, shown};
use crate::xml::sink::Sink;
use crate::xml::value::{Unresolved, line_ends, resolve_reference};

impl<'t, S: Sink> Parser<'_, 't, S> {
    pub(super) fn text(
        &mut self,
        file: File<'t>,
        from: usize,
        to: usize,
        outside: bool,
        seen_root: bool,
    ) -> Result<(), Stop> {
        let text = &file.text[from..to];
        let blank = text
            .bytes()
            .all(|byte| matches!(byte, b' ' | b'\t' | b'\n' | b'\r'));
        if outside {
            return if blank {
                Ok(())
            } else {
                self.stray(file, from, text, seen_root)
            };
        }
        if blank && !self.run.active {
            return Ok(());
        }
        if let Some(at) = text.find("]]>") {
            let text = "]]> in character data must be written ]]&gt;";
            self.fault(file, FaultCode::BadText, from + at, text)?;
        }
        if text.starts_with('&') {
            self.bad_reference(file, from, &Unresolved::NoName)?;
        }
        self.append(file, from, to, text, false);
        Ok(())
    }

    #[cold]
    pub(super) fn stray(
        &mut self,
        file: File<'t>,
        from: usize,
        text: &str,
        after: bool,
    ) -> Result<(), Stop> {
        // NUL characters are already reported as forbidden. A file that was not cut off has no
        // other text here.
        if text
            .bytes()
            .all(|byte| byte == 0 || byte.is_ascii_whitespace())
        {
            return Ok(());
        }
        let at = from + (text.len() - text.trim_ascii_start().len());
        let place = if after { "after" } else { "before" };
        let text = text.trim_ascii();
        let message = if text.starts_with("version https://git-lfs") {
            "this is a Git LFS pointer instead of the file; run `git lfs pull`".to_owned()
        } else {
            format!("text {place} the root element: {:?}", shown(text))
        };
        self.fault(file, FaultCode::TextOutsideRoot, at, &message)
    }

    pub(super) fn reference(
        &mut self,
        file: File<'t>,
        from: usize,
        to: usize,
        name: &str,
        outside: bool,
    ) -> Result<(), Stop> {
        if outside {
            let text = "a reference outside of the root element";
            return self.fault(file, FaultCode::TextOutsideRoot, from, text);
        }
        match resolve_reference(name) {
            Ok(c) => {
                self.lead(file, from);
                self.append(file, from, to, c.encode_utf8(&mut [0; 4]), true);
                Ok(())
            }
            Err(why) => {
                self.bad_reference(file, from, &why)?;
                self.append(file, from, to, &file.text[from..to], true);
                Ok(())
            }
        }
    }

    pub(super) fn bad_reference(
        &mut self,
        file: File<'t>,
        at: usize,
        why: &Unresolved,
    ) -> Result<(), Stop> {
        // The refused DOCTYPE may have defined the entity, and one fault is enough.
        if self.refused_doctype && matches!(why, Unresolved::Undefined(_)) {
            return Ok(());
        }
        self.fault(file, FaultCode::BadReference, at, &why.to_string())
    }

    pub(super) fn cdata(
        &mut self,
        file: File<'t>,
        from: usize,
        to: usize,
        outside: bool,
    ) -> Result<(), Stop> {
        const HEAD: usize = "<![CDATA[".len();
        const TAIL: usize = "]]>".len();
        if outside {
            let text = "a CDATA section outside of the root element";
            return self.fault(file, FaultCode::TextOutsideRoot, from, text);
        }
        let content = &file.text[from + HEAD..to - TAIL];
        if !self.run.active {
            // The value of a single section is exactly its content.
            self.append(file, from + HEAD, to - TAIL, content, false);
        } else {
            self.append(file, from, to, content, true);
        }
        Ok(())
    }

    /// Starts a run with the white space before a reference. White space without a reference is not
    /// character data.
    pub(super) fn lead(&mut self, file: File<'t>, to: usize) {
        let before = &file.text[..to];
        let blank = before.len() - before.trim_ascii_end().len();
        if blank > 0 && !self.run.active {
            self.append(file, to - blank, to, &before[to - blank..], false);
        }
    }

    /// Adds a piece to the run of character data. `differs` means that its value is not identical
    /// to the text from `from` to `to`.
    pub(super) fn append(
        &mut self,
        file: File<'t>,
        from: usize,
        to: usize,
        value: &str,
        differs: bool,
    ) {
        let run = &mut self.run;
        let differs = differs || value.contains('\r') || run.active;
        if !run.active {
            run.value.clear();
            (run.active, run.resolved, run.start) = (true, false, from);
        } else if !run.resolved {
            line_ends(&file.text[run.start..run.stop], &mut run.value);
        }
        if differs {
            run.resolved = true;
            // A reference to a carriage return keeps its character and is not normalized.
            if value == "\r" {
                run.value.push_str(value);
            } else {
                line_ends(value, &mut run.value);
            }
        }
        run.stop = to;
    }

    /// Ends the run of character data, because an element starts or ends.
    #[inline]
    pub(super) fn flush(&mut self, file: File<'t>) -> Result<(), Stop> {
        if !self.run.active {
            return Ok(());
        }
        self.run.active = false;
        let inside_nameless = self
            .stack
            .last()
            .is_none_or(|open| open.transparent && open.name.is_empty());
        if inside_nameless {
            return Ok(());
        }
        let (start, stop) = (
            file.start + narrow(self.run.start),
            file.start + narrow(self.run.stop),
        );
        let resolved = self.run.resolved.then_some(&*self.run.value);
        self.sink.text(start, stop, resolved)?;
        Ok(())
    }
}

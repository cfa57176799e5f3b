//! Conversion between journal data and the text and numbers in SQLite rows.

use std::sync::Arc;
use std::time::{SystemTime, UNIX_EPOCH};

use qcbus_messages::path_text::{from_text, to_text as text};
use qcbus_messages::{Digest, JobId, Verdict};
use qcbus_types::{
    Epoch, Input, Judged, Reading, RequiredBundle, RequiredSet, RestsOn, Stamp, VersionDigest,
};

pub(super) fn required_set_to_text(required_set: &RequiredSet) -> String {
    let row = |required_bundle: &RequiredBundle| {
        (
            required_bundle.name.clone(),
            required_bundle
                .version_digest
                .map(|it| format!("{:016x}", it.0)),
        )
    };
    let rows: Vec<(String, Option<String>)> = required_set.0.iter().map(row).collect();
    serde_json::to_string(&rows).unwrap_or_default()
}

fn required_set_from_text(text: &str) -> RequiredSet {
    let read = || -> Option<Vec<RequiredBundle>> {
        let rows: Vec<(String, Option<String>)> = serde_json::from_str(text).ok()?;
        let required_bundle = |(name, version_digest): (String, Option<String>)| {
            let version_digest = match version_digest {
                Some(version_digest) => Some(VersionDigest(
                    u64::from_str_radix(&version_digest, 16).ok()?,
                )),
                None => None,
            };
            Some(RequiredBundle {
                name,
                version_digest,
            })
        };
        rows.into_iter().map(required_bundle).collect()
    };
    read().map_or_else(RequiredSet::unknown, RequiredSet)
}

/// Path and, if the file exists: size, time of modification, inode, digest if it was read, time of change.
type InputRow = (String, Option<(u64, i128, u64, Option<String>, i128)>);

/// The same row in schema 1, which had no time of change.
type InputRowOfSchema1 = (String, Option<(u64, i128, u64, Option<String>)>);

/// Digest of an unreadable file in the schemas before 3.
const UNREAD: Digest = Digest([0; 32]);

pub(super) fn inputs_to_text(inputs: &[Input]) -> String {
    let rows: Vec<InputRow> = inputs
        .iter()
        .map(|input| {
            let digest = input.digest().map(|digest| digest.to_string());
            let content = input.content.stamp().map(|stamp| {
                (
                    stamp.size,
                    stamp.mtime_ns,
                    stamp.inode,
                    digest,
                    stamp.ctime_ns,
                )
            });
            (text(&input.path), content)
        })
        .collect();
    serde_json::to_string(&rows).unwrap_or_default()
}

fn inputs_from_text(text: &str) -> Option<Vec<Input>> {
    let rows = serde_json::from_str(text).ok();
    let rows: Vec<InputRow> = rows.or_else(|| rows_of_schema_1(text))?;
    let input = |(path, content): InputRow| {
        let content = match content {
            None => Reading::Absent,
            Some((size, mtime_ns, inode, digest, ctime_ns)) => {
                let stamp = Stamp {
                    size,
                    mtime_ns,
                    ctime_ns,
                    inode,
                };
                match digest.map(|digest| digest.parse()).transpose().ok()? {
                    None | Some(UNREAD) => Reading::Unread(stamp),
                    Some(digest) => Reading::Read(stamp, digest),
                }
            }
        };
        Some(Input {
            path: from_text(&path).into(),
            content,
        })
    };
    rows.into_iter().map(input).collect()
}

/// Reads rows of schema 1. A stamp without a time of change matches no file, so each file is read again and compared.
fn rows_of_schema_1(text: &str) -> Option<Vec<InputRow>> {
    let rows: Vec<InputRowOfSchema1> = serde_json::from_str(text).ok()?;
    let row = |(path, content): InputRowOfSchema1| {
        let content = content.map(|(size, mtime, inode, digest)| (size, mtime, inode, digest, 0));
        (path, content)
    };
    Some(rows.into_iter().map(row).collect())
}

fn verdict_of(text: &str) -> Option<Verdict> {
    let all = [Verdict::Accepted, Verdict::Rejected, Verdict::Undetermined];
    all.into_iter().find(|it| it.as_str() == text)
}

/// Path, digest, verdict if there was one, number of errors.
type RestsOnRow = (String, String, Option<String>, u64);

pub(super) fn rests_on_to_text(rests_on: Option<&[RestsOn]>) -> String {
    let Some(rests_on) = rests_on else {
        return String::new();
    };
    let row = |it: &RestsOn| -> RestsOnRow {
        let verdict = it.verdict.map(|verdict| verdict.as_str().to_owned());
        (text(&it.path), it.digest.to_string(), verdict, it.errors)
    };
    let rows: Vec<RestsOnRow> = rests_on.iter().map(row).collect();
    serde_json::to_string(&rows).unwrap_or_default()
}

/// Returns `None` if the dependencies are unknown or invalid. The file is then judged again.
fn rests_on_from_text(text: &str) -> Option<Vec<RestsOn>> {
    let rows: Vec<RestsOnRow> = serde_json::from_str(text).ok()?;
    let read = |(path, digest, verdict, errors): RestsOnRow| {
        Some(RestsOn {
            path: from_text(&path).into(),
            digest: digest.parse().ok()?,
            verdict: match verdict {
                Some(verdict) => Some(verdict_of(&verdict)?),
                None => None,
            },
            errors,
        })
    };
    rows.into_iter().map(read).collect()
}

pub(super) fn judged_of(row: &rusqlite::Row<'_>) -> rusqlite::Result<Option<Judged>> {
    let digest = |index| -> rusqlite::Result<Option<Digest>> {
        Ok(row.get::<_, String>(index)?.parse().ok())
    };
    let Some(verdict) = verdict_of(&row.get::<_, String>(2)?) else {
        return Ok(None);
    };
    let (own, basis, config) = (digest(3)?, digest(4)?, digest(5)?);
    let inputs = inputs_from_text(&row.get::<_, String>(12)?);
    let (Some(digest), Some(basis), Some(config), Some(inputs)) = (own, basis, config, inputs)
    else {
        return Ok(None);
    };
    let rests_on = rests_on_from_text(&row.get::<_, String>(18)?);
    Ok(Some(Judged {
        own: verdict_of(&row.get::<_, String>(16)?).unwrap_or(verdict),
        own_errors: number(row.get(17)?),
        rests_on,
        job: JobId(number(row.get(1)?)),
        verdict,
        digest,
        basis,
        config,
        required_set: Arc::new(required_set_from_text(&row.get::<_, String>(6)?)),
        epoch: Epoch(number(row.get(14)?)),
        inputs,
        racy: row.get(13)?,
        counts: [
            number(row.get(7)?),
            number(row.get(8)?),
            number(row.get(9)?),
        ],
        why: serde_json::from_str(&row.get::<_, String>(10)?).unwrap_or_default(),
        xqar: Some(row.get::<_, String>(11)?)
            .filter(|it| !it.is_empty())
            .map(|it| from_text(&it)),
    }))
}

pub(super) fn signed(number: u64) -> i64 {
    i64::try_from(number).unwrap_or(i64::MAX)
}

pub(super) fn number(signed: i64) -> u64 {
    u64::try_from(signed).unwrap_or(0)
}

/// Returns milliseconds since 1970. The value is only shown, or compared with the retention time,
/// so a clock that jumps does no harm.
pub(super) fn millis() -> i64 {
    let since = SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .unwrap_or_default();
    i64::try_from(since.as_millis()).unwrap_or(i64::MAX)
}

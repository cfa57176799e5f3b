//! Batches findings for the broker, so that no message exceeds the size limit of a broker.

use qcbus_formats::pool::Ending;
use qcbus_formats::xqar::{InfoElement, Issue, Location, Locations};
use qcbus_messages::CheckerEnd;
use qcbus_messages::codec::MAX_FROM_PEER;

/// Issues per message. It is large enough to be cheap and small enough to interleave with other
/// traffic.
const BATCH: usize = 64;
/// Bytes of the issues of one message. A larger issue is cut and sent alone.
const BATCH_BYTES: usize = MAX_FROM_PEER / 4;
/// Bytes that remain of each text of a cut issue. A broker keeps no more.
const TEXT: usize = 8 << 10;
/// Places that remain of a cut issue. A broker keeps no more.
const PLACES: usize = 64;

/// Returns the findings in order, in batches.
pub(super) fn batches(mut issues: Vec<Issue>) -> Vec<Vec<Issue>> {
    let large = issues.iter_mut().filter(|it| size(it) > BATCH_BYTES);
    large.for_each(cut);
    by_size(issues, BATCH, size)
}

/// Returns the ends of checkers in order, in batches.
pub(super) fn batches_of_ends(ends: Vec<CheckerEnd>) -> Vec<Vec<CheckerEnd>> {
    by_size(ends, usize::MAX, size_of_end)
}

/// Splits items into batches, which are limited by number and by message size. An item that exceeds
/// the size is alone in its batch.
fn by_size<T>(all: Vec<T>, most: usize, size: fn(&T) -> usize) -> Vec<Vec<T>> {
    let mut batches = Vec::new();
    let (mut batch, mut bytes) = (Vec::new(), 0);
    for one in all {
        let more = size(&one);
        if !batch.is_empty() && (batch.len() == most || bytes + more > BATCH_BYTES) {
            batches.push(std::mem::take(&mut batch));
            bytes = 0;
        }
        bytes += more;
        batch.push(one);
    }
    if !batch.is_empty() {
        batches.push(batch);
    }
    batches
}

/// Returns an upper bound of the bytes of an end in a message.
fn size_of_end(end: &CheckerEnd) -> usize {
    const NUMBERS: usize = 32;
    let ending = match &end.ending {
        Ending::Completed => 0,
        Ending::NotApplicable { reason } | Ending::Failed { reason } => reason.len(),
        Ending::Blocked { by, reason } => {
            reason.len() + by.iter().map(|id| NUMBERS + id.len()).sum::<usize>()
        }
    };
    let params = end.params.iter();
    let params = params.map(|it| NUMBERS + it.name.len() + it.value.len());
    let metadata = end.metadata.iter();
    let metadata =
        metadata.map(|it| NUMBERS + it.key.len() + it.value.len() + it.description.len());
    NUMBERS + ending + params.sum::<usize>() + metadata.sum::<usize>()
}

/// Returns an upper bound of the bytes of an issue in a message.
fn size(issue: &Issue) -> usize {
    const NUMBERS: usize = 64;
    let place = |it: &Location| {
        let texts = match it {
            Location::Xml { xpath } => xpath.len(),
            Location::Road { road_id, .. } => road_id.len(),
            Location::Message { channel, field, .. } => {
                let texts = [channel, field].into_iter().flatten();
                texts.map(String::len).sum()
            }
            _ => 0,
        };
        NUMBERS + texts
    };
    let places = |it: &Locations| {
        let elsewhere = it.elsewhere.as_ref().map_or(0, |it| {
            NUMBERS + it.path.len() + it.xpath.as_ref().map_or(0, String::len)
        });
        let here: usize = it.places.iter().map(place).sum();
        NUMBERS + it.description.len() + elsewhere + here
    };
    let locations: usize = issue.locations.iter().map(places).sum();
    let infos = issue.domain_info.iter();
    let infos =
        infos.map(|it| NUMBERS + it.name.len() + it.content.iter().map(tree).sum::<usize>());
    NUMBERS + issue.description.len() + issue.rule_uid.len() + locations + infos.sum::<usize>()
}

fn tree(element: &InfoElement) -> usize {
    let attributes = element.attributes.iter();
    let attributes: usize = attributes
        .map(|(name, value)| 16 + name.len() + value.len())
        .sum();
    let children: usize = element.children.iter().map(tree).sum();
    32 + element.name.len() + element.text.len() + attributes + children
}

/// Cuts an issue to the size that a broker keeps. A text from a file may be as long as the file.
fn cut(issue: &mut Issue) {
    shorten(&mut issue.description);
    shorten(&mut issue.rule_uid);
    issue.domain_info.clear();
    issue.locations.truncate(PLACES);
    for it in &mut issue.locations {
        shorten(&mut it.description);
        // Each kind of place may contain a very long text, so only one is kept.
        it.places.truncate(1);
        it.places.iter_mut().for_each(shorten_place);
        if let Some(elsewhere) = &mut it.elsewhere {
            shorten(&mut elsewhere.path);
            elsewhere.xpath.iter_mut().for_each(shorten);
        }
    }
    while size(issue) > BATCH_BYTES && issue.locations.pop().is_some() {}
}

fn shorten_place(place: &mut Location) {
    match place {
        Location::Xml { xpath } => shorten(xpath),
        Location::Road { road_id, .. } => shorten(road_id),
        Location::Message { channel, field, .. } => {
            [channel, field].into_iter().flatten().for_each(shorten);
        }
        _ => {}
    }
}

fn shorten(text: &mut String) {
    if text.len() > TEXT {
        let end = text.floor_char_boundary(TEXT);
        text.truncate(end);
        text.push('…');
    }
}

#[cfg(test)]
mod tests {
    use qcbus_formats::xqar::{DomainInfo, Level};
    use qcbus_messages::{FromPeer, JobId, codec};

    use super::*;

    fn saying(bytes: usize) -> Issue {
        Issue {
            id: 0,
            description: "ä".repeat(bytes / 2),
            level: Level::Error,
            rule_uid: "uid".to_owned(),
            locations: Vec::new(),
            domain_info: Vec::new(),
        }
    }

    fn encoded(issues: Vec<Issue>) -> usize {
        let (job, checker) = (JobId(1), 0);
        let message = FromPeer::Issues {
            job,
            checker,
            issues,
        };
        codec::encode(&message).unwrap().len()
    }

    #[test]
    fn findings_are_batched_by_count_and_size() {
        let lengths = |issues| batches(issues).iter().map(Vec::len).collect::<Vec<_>>();
        assert_eq!(lengths(Vec::new()), [0; 0]);
        assert_eq!(lengths(vec![saying(100); 130]), [64, 64, 2]);
        assert_eq!(lengths(vec![saying(400 << 10); 5]), [2, 2, 1]);
        let mixed = vec![
            saying(100),
            saying(900 << 10),
            saying(900 << 10),
            saying(100),
        ];
        assert_eq!(lengths(mixed), [2, 2]);
    }

    #[test]
    fn short_checker_ends_share_message_and_long_are_split() {
        let end = |bytes: usize| CheckerEnd {
            checker: 1,
            ending: Ending::NotApplicable {
                reason: "x".repeat(bytes),
            },
            params: Vec::new(),
            metadata: Vec::new(),
        };
        let lengths = |ends| {
            batches_of_ends(ends)
                .iter()
                .map(Vec::len)
                .collect::<Vec<_>>()
        };
        assert_eq!(lengths(vec![end(60); 323]), [323]);
        assert_eq!(lengths(vec![end(400 << 10); 5]), [2, 2, 1]);
        for ended in batches_of_ends(vec![end(30 << 10); 200]) {
            let job = JobId(1);
            let message = codec::encode(&FromPeer::CheckersDone { job, ended }).unwrap();
            assert!(message.len() <= MAX_FROM_PEER, "{}", message.len());
        }
    }

    #[test]
    fn finding_with_huge_text_arrives_with_same_level() {
        let huge = "x".repeat(MAX_FROM_PEER);
        let place = Locations {
            description: huge.clone(),
            elsewhere: None,
            places: vec![
                Location::Xml {
                    xpath: huge.clone()
                };
                3
            ],
        };
        let element = InfoElement {
            name: huge.clone(),
            ..InfoElement::default()
        };
        let everywhere = Issue {
            description: huge,
            locations: vec![place; 100],
            domain_info: vec![DomainInfo {
                name: String::new(),
                content: vec![element],
            }],
            ..saying(0)
        };
        for issue in [saying(MAX_FROM_PEER * 2), everywhere] {
            let mut batches = batches(vec![issue]);
            let batch = batches.pop().unwrap();
            assert_eq!((batches.len(), batch.len()), (0, 1));
            assert_eq!(batch[0].level, Level::Error);
            assert!(batch[0].description.ends_with('…'));
            assert!(encoded(batch) < MAX_FROM_PEER);
        }
    }
}

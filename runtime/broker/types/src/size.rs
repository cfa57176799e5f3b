//! Sizes of findings: estimates of the memory that they occupy, and limits.

use qcbus_formats::xqar::{DomainInfo, InfoElement, Issue, Location, Locations, Metadata, Param};

/// Estimates the memory that an issue occupies.
pub fn weight(issue: &Issue) -> usize {
    let place = |place: &Location| match place {
        Location::Xml { xpath } => 64 + xpath.len(),
        Location::Road { road_id, .. } => 64 + road_id.len(),
        Location::Message { channel, field, .. } => {
            let length = |it: &Option<String>| it.as_ref().map_or(0, String::len);
            64 + length(channel) + length(field)
        }
        _ => 64,
    };
    let places = |it: &Locations| {
        let elsewhere = it.elsewhere.as_ref();
        let xpath = elsewhere
            .and_then(|it| it.xpath.as_ref())
            .map_or(0, String::len);
        let elsewhere = elsewhere.map_or(0, |it| it.path.len()) + xpath;
        64 + it.description.len() + elsewhere + it.places.iter().map(place).sum::<usize>()
    };
    let infos = |it: &DomainInfo| it.name.len() + it.content.iter().map(info_weight).sum::<usize>();
    256 + issue.description.len()
        + issue.rule_uid.len()
        + issue.locations.iter().map(places).sum::<usize>()
        + issue.domain_info.iter().map(infos).sum::<usize>()
}

/// Estimates the memory of the parameters and metadata of a checker's run.
pub fn facts_weight(params: &[Param], metadata: &[Metadata]) -> usize {
    let params = params.iter().map(|it| 48 + it.name.len() + it.value.len());
    let metadata = metadata
        .iter()
        .map(|it| 72 + it.key.len() + it.value.len() + it.description.len());
    params.sum::<usize>() + metadata.sum::<usize>()
}

fn info_weight(element: &InfoElement) -> usize {
    let attributes = element
        .attributes
        .iter()
        .map(|(name, value)| 48 + name.len() + value.len());
    let children = element.children.iter().map(info_weight);
    96 + element.name.len()
        + element.text.len()
        + attributes.sum::<usize>()
        + children.sum::<usize>()
}

/// Cuts an issue down to the permitted size.
pub fn clip(issue: &mut Issue, max: usize) {
    clip_text(&mut issue.description, max);
    clip_text(&mut issue.rule_uid, 512);
    clip_list(&mut issue.locations, 64);
    clip_list(&mut issue.domain_info, 16);
    for place in &mut issue.locations {
        clip_text(&mut place.description, max);
        clip_list(&mut place.places, 16);
        if let Some(elsewhere) = &mut place.elsewhere {
            clip_text(&mut elsewhere.path, max);
            elsewhere
                .xpath
                .iter_mut()
                .for_each(|xpath| clip_text(xpath, max));
        }
    }
}

/// Truncates a list and frees the memory of the rest.
fn clip_list<T>(list: &mut Vec<T>, max: usize) {
    if list.len() > max {
        list.truncate(max);
        list.shrink_to_fit();
    }
}

/// Truncates a text at a character boundary and frees the memory of the rest.
pub fn clip_text(text: &mut String, max: usize) {
    if text.len() > max {
        let end = (0..=max)
            .rev()
            .find(|at| text.is_char_boundary(*at))
            .unwrap_or(0);
        text.truncate(end);
        text.push('…');
        // Truncation alone would keep the whole memory.
        text.shrink_to_fit();
    }
}

//! Pages from templates.

/// Puts values in the places of a template, `{{name}}` each. What a value holds is not looked at again: it may well contain such
/// a place.
///
/// # Panics
/// At a place that no value is given for.
pub(crate) fn fill(template: &str, values: &[(&str, &str)]) -> String {
    let mut page =
        String::with_capacity(template.len() + values.iter().map(|value| value.1.len()).sum::<usize>());
    let mut rest = template;
    while let Some((before, after)) = rest.split_once("{{") {
        let (name, behind) = after.split_once("}}").expect("a place that ends");
        let value = values.iter().find(|(known, _)| *known == name);
        page.push_str(before);
        page.push_str(value.unwrap_or_else(|| panic!("no value for {name}")).1);
        rest = behind;
    }
    page + rest
}

#[cfg(test)]
mod tests {
    use super::fill;

    #[test]
    fn values_are_not_templates() {
        let page = fill("<{{a}}|{{b}}|{{a}}>", &[("a", "{{b}}"), ("b", "{{script}} }}")]);
        assert_eq!(page, "<{{b}}|{{script}} }}|{{b}}>");
        assert_eq!(fill("plain", &[]), "plain");
    }
}

//! The daemon's document of its interface, and whether an answer is as it says.

use std::sync::OnceLock;

use serde_json::Value;

use crate::http::Answer;

/// The document, as it lies beside the daemon's sources.
///
/// # Panics
/// When it is no JSON.
pub fn document() -> &'static Value {
    static DOCUMENT: OnceLock<Value> = OnceLock::new();
    DOCUMENT.get_or_init(|| serde_json::from_str(include_str!("../../daemon/src/web/openapi.json")).expect("a document"))
}

/// Fails unless the document knows this answer to this request, and it fits. An unknown path has a problem for an answer.
///
/// # Panics
/// When it does not.
pub fn assert_fits(method: &str, target: &str, answer: &Answer) {
    let path = target.split('?').next().unwrap_or(target);
    let known = document()["paths"].as_object().expect("paths").iter().find(|(template, _)| is_of(path, template));
    let operation = known.and_then(|(_, methods)| methods.get(method.replace("HEAD", "GET").to_ascii_lowercase()));
    let responses = operation.map(|operation| &operation["responses"]);
    let expected = responses.and_then(|responses| responses.get(answer.status.to_string()));
    let Some(expected) = expected else {
        assert!(answer.status >= 400, "{method} {target}: {} is not in the document", answer.status);
        assert_eq!(answer.header("content-type"), Some("application/problem+json"), "{method} {target}");
        if method != "HEAD" {
            fits(&answer.json(), &document()["components"]["schemas"]["Problem"], target);
        }
        return;
    };
    let Some(content) = expected.get("content").filter(|_| method != "HEAD") else { return };
    let kind = answer.header("content-type").unwrap_or_default().split(';').next().unwrap_or_default();
    let schema = content.get(kind).unwrap_or_else(|| panic!("{method} {target}: {kind} is not in the document"));
    if kind == "application/json" {
        fits(&answer.json(), &schema["schema"], target);
    }
}

fn is_of(path: &str, template: &str) -> bool {
    let (parts, wanted): (Vec<_>, Vec<_>) = (path.split('/').collect(), template.split('/').collect());
    parts.len() == wanted.len() && parts.iter().zip(&wanted).all(|(part, wanted)| part == wanted || wanted.starts_with('{'))
}

/// As much of JSON Schema as the document uses.
///
/// # Panics
/// When the value is not of the schema.
pub fn fits(value: &Value, schema: &Value, at: &str) {
    if let Some(name) = schema.get("$ref").and_then(Value::as_str).and_then(|name| name.rsplit('/').next()) {
        let schema = document()["components"]["schemas"].get(name);
        return fits(value, schema.unwrap_or_else(|| panic!("there is no schema {name}")), at);
    }
    match schema["type"].as_str().expect("a type") {
        "object" => object_fits(value, schema, at),
        "array" => {
            let items = value.as_array().unwrap_or_else(|| panic!("{at}: {value} is no list"));
            items.iter().for_each(|item| fits(item, &schema["items"], at));
        }
        "string" => {
            let text = value.as_str().unwrap_or_else(|| panic!("{at}: {value} is no text"));
            let of = schema.get("enum").and_then(Value::as_array);
            assert!(of.is_none_or(|of| of.iter().any(|word| word == text)), "{at}: {text} is none of {of:?}");
        }
        "integer" => {
            let number = value.as_i64().unwrap_or_else(|| panic!("{at}: {value} is no whole number"));
            assert!(schema["minimum"].as_i64().is_none_or(|least| number >= least), "{at}: {number} is too small");
            assert!(schema["maximum"].as_i64().is_none_or(|most| number <= most), "{at}: {number} is too large");
        }
        "boolean" => assert!(value.is_boolean(), "{at}: {value} is neither true nor false"),
        other => panic!("{at}: the type {other} is not checked"),
    }
}

fn object_fits(value: &Value, schema: &Value, at: &str) {
    let object = value.as_object().unwrap_or_else(|| panic!("{at}: {value} is no object"));
    for name in schema.get("required").and_then(Value::as_array).into_iter().flatten().filter_map(Value::as_str) {
        assert!(object.contains_key(name), "{at}: {name} is missing in {value}");
    }
    for (name, value) in object {
        let at = format!("{at}: {name}");
        match (schema["properties"].get(name), schema.get("additionalProperties")) {
            (Some(schema), _) => fits(value, schema, &at),
            (None, Some(Value::Bool(false))) => panic!("{at} is not in the document"),
            (None, Some(schema)) => fits(value, schema, &at),
            (None, None) => {}
        }
    }
}

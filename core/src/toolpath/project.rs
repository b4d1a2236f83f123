//! Projects of CAMotics: tools, a workpiece and the names of files, in JSON.

use super::program::ReadError;
use super::tool::{Shape, Tool};
use crate::curves::{Finding, Findings};
use serde_json::Value;

/// A project.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Project {
    /// In the order of their numbers; lengths in millimetres.
    pub tools: Vec<Tool>,
    /// Corners of the stock, in millimetres, if the project names them.
    pub workpiece: Option<[[f64; 3]; 2]>,
    /// Names of its tool paths, relative to itself.
    pub files: Vec<String>,
    /// Oddities.
    pub findings: Vec<Finding>,
}

fn bad(path: impl Into<String>, problem: impl Into<String>) -> ReadError {
    ReadError::Json { path: path.into(), problem: problem.into() }
}

fn unit(value: Option<&Value>) -> Option<f64> {
    match value?.as_str()?.to_ascii_lowercase().as_str() {
        "metric" | "mm" | "millimeters" => Some(1.0),
        "imperial" | "inch" | "inches" => Some(25.4),
        _ => None,
    }
}

/// Reads a project. O(length).
///
/// # Errors
/// [`ReadError::Json`] if it is none.
pub fn read(bytes: &[u8]) -> Result<Project, ReadError> {
    let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let value: Value = serde_json::from_slice(text).map_err(|error| bad("", error.to_string()))?;
    let root = value.as_object().ok_or_else(|| bad("", "no object"))?;
    if !root.contains_key("files") && !root.contains_key("tools") && !root.contains_key("workpiece") {
        return Err(bad("", "neither files nor tools nor a workpiece"));
    }
    let mut findings = Findings::default();
    let general = unit(root.get("units")).unwrap_or(1.0);
    let mut tools = Vec::new();
    for (number, tool) in root.get("tools").and_then(Value::as_object).into_iter().flatten() {
        match read_tool(number, tool, general) {
            Ok(tool) => tools.push(tool),
            Err(problem) => findings.add(0, "a tool is not read", format!("{number}: {problem}")),
        }
    }
    tools.sort_by_key(|tool: &Tool| tool.number);
    let workpiece = root.get("workpiece").and_then(|piece| bounds(piece, general));
    let files = root.get("files").and_then(Value::as_array).into_iter().flatten();
    let files = files.filter_map(|file| Some(file.as_str()?.to_owned())).collect();
    Ok(Project { tools, workpiece, files, findings: findings.finish() })
}

fn bounds(piece: &Value, unit: f64) -> Option<[[f64; 3]; 2]> {
    let corner = |name| {
        let list = piece.get("bounds")?.get(name)?.as_array()?;
        let mut corner = [0.0; 3];
        for (axis, number) in corner.iter_mut().enumerate() {
            *number = list.get(axis)?.as_f64()? * unit;
        }
        Some(corner)
    };
    Some([corner("min")?, corner("max")?])
}

fn read_tool(number: &str, tool: &Value, general: f64) -> Result<Tool, String> {
    let number = number.parse().map_err(|_| "its number is none".to_owned())?;
    let unit = unit(tool.get("units")).unwrap_or(general);
    let measure = |name: &str| tool.get(name).and_then(Value::as_f64).filter(|value| *value >= 0.0).map(|value| value * unit);
    let diameter = measure("diameter").filter(|diameter| *diameter > 0.0).ok_or("it has no diameter")?;
    let length = measure("length").filter(|length| *length > 0.0);
    let cone = |tip: f64| {
        let length = length.ok_or("a cone has no length")?;
        Ok::<_, String>(Shape::Taper { tip, angle: (0.5 * (diameter - tip)).atan2(length).to_degrees() })
    };
    let shape = match tool.get("shape").and_then(Value::as_str).unwrap_or("cylindrical").to_ascii_lowercase().as_str() {
        "cylindrical" => Shape::Flat,
        "ballnose" | "spheroid" => Shape::Ball,
        "conical" => cone(0.0)?,
        "snubnose" => cone(measure("snub_diameter").ok_or("it has no snub_diameter")?)?,
        other => return Err(format!("its shape {other} is not known")),
    };
    Ok(Tool { length: length.unwrap_or(f64::INFINITY), ..Tool::new(number, shape, diameter) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_project_has_tools_stock_and_files() {
        let text =
            br#"{"units": "metric", "tools": {"2": {"units": "imperial", "shape": "ballnose", "length": 1, "diameter": 0.125},
            "1": {"shape": "conical", "diameter": 2, "length": 1}, "3": {"shape": "x", "diameter": 1}},
            "workpiece": {"automatic": false, "bounds": {"min": [0, 0, -20], "max": [80, 80, 0]}}, "files": ["bear.nc"]}"#;
        let project = read(text).expect("a project");
        assert_eq!(project.files, ["bear.nc"]);
        assert_eq!(project.workpiece, Some([[0.0, 0.0, -20.0], [80.0, 80.0, 0.0]]));
        assert_eq!(project.tools.len(), 2);
        assert_eq!((project.tools[1].shape, project.tools[1].diameter), (Shape::Ball, 3.175));
        assert!(matches!(project.tools[0].shape, Shape::Taper { angle, .. } if (angle - 45.0).abs() < 1e-9));
        assert_eq!(project.findings.len(), 1);
        assert!(read(b"[1]").is_err() && read(b"{").is_err() && read(b"{\"x\": 1}").is_err());
    }
}

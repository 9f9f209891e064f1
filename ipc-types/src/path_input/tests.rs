use super::*;

fn names() -> Vec<String> {
    vec!["x".into(), "y".into()]
}

fn table(text: &str) -> Result<Vec<InputPiece>, String> {
    parse_table("p.csv", text, &names()).map_err(|error| error.to_string())
}

#[track_caller]
fn refused(text: &str, words: &[&str]) {
    let message = table(text).unwrap_err();
    assert!(words.iter().all(|word| message.contains(word)), "{message}");
}

#[test]
fn columns_come_in_any_order_and_rows_are_joined() {
    let pieces = table("mode,y,t,x\ntransit,1,0,0\n\ntransfer,2,1,0.5\r\ntransfer,3,1,0.75\n").unwrap();
    assert_eq!(pieces.len(), 2);
    assert_eq!(pieces[0].control_points, [[0.0, 1.0], [0.5, 2.0]]);
    assert_eq!((pieces[0].mode, pieces[1].mode), (Some(Mode::Transit), Some(Mode::Transfer)));
    assert_eq!((pieces[0].place.as_str(), pieces[1].place.as_str()), ("line 2", "line 4"));
}

#[test]
fn a_single_row_stays() {
    let pieces = table("x,y\n1,2\n").unwrap();
    assert_eq!(pieces[0].control_points, [[1.0, 2.0], [1.0, 2.0]]);
    assert_eq!(pieces[0].mode, None);
}

#[test]
fn bad_tables_name_line_column_and_value() {
    refused("", &["empty"]);
    refused("x,y\n", &["no rows"]);
    refused("x,y,z\n1,2,3\n", &["p.csv:1", "`z`", "x, y"]);
    refused("x\n1\n", &["p.csv:1", "`y`", "missing"]);
    refused("x,y,x\n1,2,3\n", &["p.csv:1", "`x`", "twice"]);
    refused("x,y\n1,2\n1\n", &["p.csv:3", "1 fields", "expected 2"]);
    refused("x,y\n1,NaN\n", &["p.csv:2", "`y`", "`NaN`", "finite"]);
    refused("x,y\n1,2\n-inf,2\n", &["p.csv:3", "`x`", "`-inf`"]);
    refused("x,y\n1,two\n", &["p.csv:2", "`y`", "`two`"]);
    refused("x,y,mode\n1,2,carry\n", &["p.csv:2", "`mode`", "`carry`"]);
    refused("t,x,y\n1,1,2\n0.5,1,2\n", &["p.csv:3", "`t`", "0.5"]);
}

fn curves(text: &str) -> Result<Vec<InputPiece>, String> {
    parse_curves("p.json", text, &names()).map_err(|error| error.to_string())
}

#[test]
fn curves_are_put_in_the_order_of_the_scene() {
    let text = r#"{"coordinates": ["y", "x"], "length": 3,
                   "segments": [{"mode": "transfer", "pieces": [[[0, 1], [2, 3], [4, 5]]], "regions": [7]}]}"#;
    let pieces = curves(text).unwrap();
    assert_eq!(pieces[0].control_points, [[1.0, 0.0], [3.0, 2.0], [5.0, 4.0]]);
    assert_eq!(pieces[0].mode, Some(Mode::Transfer));
    assert_eq!(pieces[0].place, "segments[0].pieces[0]");
}

#[test]
fn bad_curves_name_the_field() {
    let refused = |coordinates: &str, piece: &str, words: &str| {
        let text = format!(r#"{{"coordinates": {coordinates}, "segments": [{{"pieces": [{piece}]}}]}}"#);
        let message = curves(&text).unwrap_err();
        assert!(message.contains(words), "{message}");
    };
    refused(r#"["x"]"#, "[[0], [1]]", "coordinates = [x]");
    refused(r#"["x", "x"]"#, "[[0, 1], [1, 1]]", "coordinates = [x, x]");
    refused(r#"["x", "y"]"#, "[[0, 1]]", "length of segments[0].pieces[0] = 1");
    refused(r#"["x", "y"]"#, "[[0, 1], [0]]", "length of segments[0].pieces[0][1] = 1");
    refused(r#"["x", "y"]"#, "[[0, 1], [0, null]]", "line 1 column");
    refused(r#"["x", "y"]"#, "", "no pieces");
}

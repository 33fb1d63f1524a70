//! Tables as CSV.

use proptest::prelude::*;
use qtable::*;

use crate::support::zeros;

proptest! {
    #[test]
    fn csv_comes_back_bit_for_bit(
        values in prop::collection::vec(prop::num::f64::NORMAL | prop::num::f64::ZERO, 12),
        visits in prop::collection::vec(0u32..5, 12),
        masked in any::<bool>(),
    ) {
        let mut table = zeros(4, 3);
        for (index, (&value, &count)) in values.iter().zip(&visits).enumerate() {
            let (state, action) = (State(index / 3), Action(index % 3));
            table.set(state, action, value).unwrap();
            (0..count).for_each(|_| table.visit(state, action).unwrap());
        }
        if masked {
            table.restrict(|s, a| (s.0 + a.0) % 2 == 0 || a.0 == 1);
        }
        // What a mask forbids keeps its value.
        let back = QTable::from_csv(&table.to_csv()).unwrap();
        prop_assert_eq!(back.to_csv(), table.to_csv());
        prop_assert_eq!(back, table);
    }

    #[test]
    fn random_text_is_no_table(
        text in "\\PC{0,80}",
        lines in prop::collection::vec("[0-9,.eE-]{0,12}", 0..6),
    ) {
        prop_assert!(QTable::from_csv(&text).is_err());
        let with_header = format!("state,action,value,visits,offered\n{}", lines.join("\n"));
        // Whatever comes of it, it is no panic.
        let _ = QTable::from_csv(&with_header);
    }
}

#[test]
fn other_programs_csv_is_read() {
    let read = |text| QTable::from_csv(text).unwrap();
    let table = read("state,action,value,visits,offered\n0,0,1,3,1\n0,1,2,0,1\n");
    // A byte-order mark, columns and lines in another order, counts as floats, Windows line ends,
    // spaces.
    let other = "\u{feff}action, state,visits,value\r\n1,0,0.0,2\r\n0,0,3.0,1.0\r\n";
    assert_eq!(read(other), table);
    let bare = read("state,action,value\n0,0,1\n0,1,2\n");
    assert_eq!(bare.row(State(0)), [1.0, 2.0]);
    assert_eq!(bare.visits(State(0), Action(0)), 0);
}

#[test]
fn damaged_csv_is_refused_with_its_line() {
    let read = |body: &str| QTable::from_csv(&format!("state,action,value,visits,offered\n{body}"));
    for (body, wanted) in [
        ("0,0,one,0,1", 2),
        ("0,0,1,0,1\n0,1,1,-1,1", 3),
        ("0,0,1,0.5,1", 2),
        ("0,0,1,0", 2),
        ("0,0,1,0,2", 2),
        ("0,0,1,0,1,7", 2),
        ("99999999999999999999,0,1,0,1", 2),
        ("0,0,1,0,1\n0,0,1,0,1\n1,0,1,0,1\n1,1,1,0,1", 3),
    ] {
        match read(body) {
            Err(Error::Csv(line, _)) => assert_eq!(line, wanted, "{body}"),
            other => panic!("{body}: {other:?}"),
        }
    }
    for body in [
        "0,0,1,0,1\n0,2,1,0,1",
        "0,0,1,0,1\n0,1,1,0,1\n1,0,1,0,1",
        "1000000000000,0,1,0,1",
    ] {
        assert_refused!(read(body), Error::WrongLength { .. });
    }
    assert_refused!(read("0,0,NaN,0,1"), Error::NotFinite { what: "value", .. });
    assert!(read("0,0,1,0,0").is_ok(), "a terminal state");
    assert_refused!(read(""), Error::Shape { .. });
    let no_header = QTable::from_csv("0,0,1,1,1\n0,1,1,1,1");
    assert_refused!(no_header, Error::Csv(2, _));
}

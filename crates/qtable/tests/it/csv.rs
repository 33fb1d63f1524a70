//! Tables as CSV: what is written comes back, and nothing else does.

use proptest::prelude::*;
use qtable::{Action, ActionMask, Error, QTable, State};

proptest! {
    #[test]
    fn csv_comes_back_to_the_bit(
        values in prop::collection::vec(
            prop::num::f64::NORMAL | prop::num::f64::ZERO | prop::num::f64::SUBNORMAL,
            12,
        ),
        visits in prop::collection::vec(0u8..3, 12),
        masked in any::<bool>(),
    ) {
        let mut table = QTable::new(4, 3).unwrap();
        for (index, &value) in values.iter().enumerate() {
            let (state, action) = (State(index / 3), Action(index % 3));
            table.set(state, action, value).unwrap();
            for _ in 0..visits[index] {
                table.visit(state, action).unwrap();
            }
        }
        if masked {
            let mask = ActionMask::new(4, 3, |s, a| (s.0 + a.0) % 2 == 0 || a.0 == 1);
            table.set_mask(Some(mask.unwrap())).unwrap();
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
    let table =
        QTable::from_csv("state,action,value,visits,offered\n0,0,1,3,1\n0,1,2,0,1\n").unwrap();
    // A byte-order mark, columns and lines in another order, counts as floats, Windows line ends,
    // spaces.
    let other = "\u{feff}action, state,visits,value\r\n1,0,0.0,2\r\n0,0,3.0,1.0\r\n";
    assert_eq!(QTable::from_csv(other).unwrap(), table);
    let bare = QTable::from_csv("state,action,value\n0,0,1\n0,1,2\n").unwrap();
    assert_eq!(
        (bare.row(State(0)), bare.visits(State(0), Action(0))),
        (&[1.0, 2.0][..], 0)
    );
}

#[test]
fn damaged_csv_is_refused_with_its_line() {
    let read = |body: &str| QTable::from_csv(&format!("state,action,value,visits,offered\n{body}"));
    let line = |body| match read(body) {
        Err(Error::Csv { line, .. }) => line,
        other => panic!("{other:?}"),
    };
    assert_eq!(line("0,0,one,0,1"), 2);
    assert_eq!(line("0,0,1,0,1\n0,1,1,-1,1"), 3);
    assert_eq!(line("0,0,1,0.5,1"), 2);
    assert_eq!(line("0,0,1,0"), 2);
    assert_eq!(line("0,0,1,0,2"), 2);
    assert_eq!(line("0,0,1,0,1,7"), 2);
    assert_eq!(line("99999999999999999999,0,1,0,1"), 2);
    assert_eq!(line("0,0,1,0,1\n0,0,1,0,1\n1,0,1,0,1\n1,1,1,0,1"), 3);
    for body in [
        "0,0,1,0,1\n0,2,1,0,1",
        "0,0,1,0,1\n0,1,1,0,1\n1,0,1,0,1",
        "1000000000000,0,1,0,1",
    ] {
        assert!(
            matches!(read(body), Err(Error::WrongLength { .. })),
            "{body}"
        );
    }
    assert!(matches!(
        read("0,0,NaN,0,1"),
        Err(Error::ValueNotFinite { .. })
    ));
    assert!(read("0,0,1,0,0").is_ok(), "a terminal state");
    assert!(matches!(read(""), Err(Error::EmptyShape { .. })));
    assert!(matches!(
        QTable::from_csv("0,0,1,1,1\n0,1,1,1,1"),
        Err(Error::Csv { line: 2, .. })
    ));
}

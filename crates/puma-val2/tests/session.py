"""A session with the emulated controller, as somebody with Python and pyserial would hold it.

Usage: session.py PORT. Prints what the terminal showed.
"""

import sys
import time

import serial


def talk(port, line, until):
    """Types a line and reads until the screen ends with one of `until`."""
    port.write(line.encode("ascii") + b"\r")
    return listen(port, until)


def listen(port, until):
    screen = b""
    deadline = time.monotonic() + 20
    while time.monotonic() < deadline:
        screen += port.read(max(1, port.in_waiting))
        if screen.endswith(until) and not port.in_waiting:
            sys.stdout.write(screen.decode("ascii"))
            return screen
    raise SystemExit("nothing more came after: %r" % screen)


PROMPT = (b"\r\n.",)
QUESTION = (b"? ", b"?\r\n")


def main(path):
    with serial.Serial(path, 9600, timeout=0.2) as port:
        # pyserial throws away what came before the port was opened: the first question.
        talk(port, "N", QUESTION)
        talk(port, "N", PROMPT)
        talk(port, "DO READY", PROMPT)
        talk(port, "CAL", QUESTION)
        talk(port, "Y", PROMPT)
        lines = ["SPEED 50", "DO READY", "DO DRIVE 1,10,100", "DO DRIVE 2,5,100"]
        for line in (*lines, "DO DRIVE 3,5,100", "WHERE"):
            talk(port, line, PROMPT)
        talk(port, "DO DRIVE 1,200,100", PROMPT)
        talk(port, "HERE P1", QUESTION)
        talk(port, "", PROMPT)
    # Closed and opened again: the controller is as it was left.
    with serial.Serial(path, 9600, timeout=0.2) as port:
        talk(port, "DO MOVE #PPOINT(0,-90,90,0,0,0)", PROMPT)
        talk(port, "DO OPENI", PROMPT)
        talk(port, "EDIT LOOK", QUESTION)
        for line in ("SPEED 20 ALWAYS", "MOVES P1", "BREAK", 'TYPE "there"', "WAIT SIG(1001)"):
            talk(port, line, QUESTION)
        talk(port, "E", PROMPT)
        talk(port, "EXECUTE LOOK", (b"there\r\n",))
        talk(port, "STATUS", (b"\r\n*",))
        talk(port, "ABORT", PROMPT)


if __name__ == "__main__":
    main(sys.argv[1])

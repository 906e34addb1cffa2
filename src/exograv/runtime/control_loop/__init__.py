"""Messages between the processes of the live loop: guard, control, worker and their parent."""

"""Who is wired to whom: one file per thing that a person does with the machine."""

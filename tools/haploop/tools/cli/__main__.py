"""``python -m haploop.tools.cli``: the command line without the installed script."""

from haploop.tools.cli.main import main

if __name__ == "__main__":
    main()

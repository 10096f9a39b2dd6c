# SPDX-License-Identifier: GPL-2.0-or-later
# Completion for bash. pokeysctl itself says what may be written: a line for each command.

# Values of the kind that the help names so.
_pokeysctl_values()
{
	case $1 in
	DIR) compgen -d -- "$2" ;;
	FILE | INI | HAL) compgen -f -- "$2" ;;
	NIC) compgen -W "$(ls /sys/class/net 2>/dev/null)" -- "$2" ;;
	DEVICE) compgen -W "$("${COMP_WORDS[0]}" devices ${directory:+-r "$directory"} \
		2>/dev/null)" -- "$2" ;;
	NAME) compgen -W "$("${COMP_WORDS[0]}" ${device:+get ${directory:+-r "$directory"}} \
		"${device:-names}" 2>/dev/null | grep -o "^[^ ]\+")" -- "$2" ;;
	*) [[ $1 == [a-z]* ]] && compgen -W "$1" -- "$2" ;;
	esac
}

_pokeysctl()
{
	local current=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD-1]}
	local command= device= directory= last= word name arguments options kinds=
	local -i behind=0
	local -A takes=()

	COMPREPLY=()
	while IFS=: read -r name arguments options; do
		takes[$name]=$arguments:$options
	done < <("${COMP_WORDS[0]}" --completion 2>/dev/null)

	# bash takes --option=value apart into three words
	if [[ $current == = ]]; then
		current=
	elif [[ $before == = ]]; then
		before=${COMP_WORDS[COMP_CWORD-2]}
	fi
	for word in "${COMP_WORDS[@]:1:COMP_CWORD-1}"; do
		[[ $word == = ]] && continue
		if [[ $last == -r || $last == --runtime-directory ]]; then
			directory=$word
		elif [[ $word != -* && " ${takes[*]}" != *" $last="* ]]; then
			if [[ $command ]]; then
				((behind)) || device=$word
				behind+=1
			else
				command=$word
			fi
		fi
		last=$word
	done

	if [[ $before == -r ]]; then
		before=--runtime-directory
	fi
	# options of the command, or of all commands if none has been typed yet
	if [[ $before == --* && " ${takes[${command:-none}]:-${takes[*]}}" =~ " $before="([A-Z,]+) ]]; then
		mapfile -t COMPREPLY < <(_pokeysctl_values "${BASH_REMATCH[1]}" "$current")
		return
	fi
	arguments=${takes[${command:-none}]%%:*}
	options=${takes[${command:-none}]#*:}
	[[ $arguments == DEVICE* ]] || device=
	if [[ $current == -* ]]; then
		[[ $command ]] || options="--help --version"
		mapfile -t COMPREPLY < <(
			for word in $options; do
				compgen -W "${word%%=*}" -- "$current"
			done)
		return
	fi
	if [[ ! $command ]]; then
		kinds=${!takes[*]}
	elif [[ $arguments == [a-z]* ]] && ((behind == 0)); then
		kinds=${arguments//[^a-z ]/}
	elif [[ $arguments == "DEVICE [NAME ...]" ]]; then
		kinds=DEVICE
		((behind == 0)) || kinds=NAME
	elif [[ $arguments == *...* ]] || ((behind < 2)); then
		kinds=${arguments//[^A-Z ]/}
	fi
	mapfile -t COMPREPLY < <(
		for word in $kinds; do
			_pokeysctl_values "$word" "$current"
		done)
}

complete -o filenames -F _pokeysctl pokeysctl
